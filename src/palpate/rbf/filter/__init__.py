"""The sequential filter: one observation at a time.

step         the whole of it: the rules below in order
settings     which rules, and their thresholds          presets      named members of the family
state        what is remembered                         covariance   what is kept of its uncertainty
observation  what it is shown                           model        the state's value and Jacobian
growth       when a unit is added                       pruning      when one is removed
updates      what an observation changes                significance a unit's mean contribution
noise        how far an observation is believed         memory       what must not be unlearnt
"""
