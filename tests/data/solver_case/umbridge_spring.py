"""A server of the `umbridge` package for tests: a spring of 2 N/mm. It refuses one region, and lies in another."""

import sys

import umbridge


class Spring(umbridge.Model):
    def __init__(self):
        super().__init__("spring")

    def get_input_sizes(self, config):
        return [1, 1]

    def get_output_sizes(self, config):
        return [1, 2]

    def __call__(self, parameters, config):
        (mm,), (share,) = parameters
        if mm > 9.0:
            raise ValueError("overstretched")
        return [[mm**2 if mm > 1.0 else float("nan")], [2 * mm * share, 2 * mm * (1 - share)]]

    def supports_evaluate(self):
        return True


umbridge.serve_models([Spring()], int(sys.argv[1]))
