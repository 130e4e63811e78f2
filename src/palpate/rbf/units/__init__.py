"""What a network is made of.

forms        what a unit may look like: isotropic, axis-aligned, rotated, rank r
regressors   units and tail, with all derivatives by place and by parameter
"""
