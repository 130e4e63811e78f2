"""What a user need not know: form, radial function, size and thresholds, from the data.

choice        a network from nothing but samples        race          forms and sizes refined a little, the best go on
kernel_layer  units at the data that share one metric   committee     several networks averaged into one
arrays        samples as a user has them               calibration   how far the network may be off
finish        weights from all samples, intervals      fitted        what is handed over
problem       samples scaled, outputs by their modes
automatic     the filter's thresholds from a target     scatter       noise and spacing of samples
"""
