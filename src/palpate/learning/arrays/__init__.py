"""A network from nothing but samples: what a user need not know is chosen from the data.

fit            the stages of the choice                 held_out      candidates, and samples that judge them
members        several networks for one mean            calibration   how far the network may be off
array_samples  samples as a user has them, and scaled   fitted        the result
"""
