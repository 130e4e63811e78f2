"""The way out: learnt bodies and networks in other people's tools, from one evaluator core in C99.

weights_block   what goes out: arrays in fixed places, as a binary block and as tables of C
field_tables    a field's modes as whole numbers of two bytes
core_source     the core's sources as one text, with the baseline and the memory of a body
c_files         header, source, example and CMake file of a body or a network
compilers       the C compilers of this machine, and how a program is compiled with them
check_points    places at which every export is compared with palpate, and how
answer_network  numbers, curves and fields that no hand feels, as networks whose outputs go out
check_answers   how far these are from palpate
check_program   a compiled export that answers them
c_export        `palpate export c`: write, compile and compare
lib_export      `palpate export lib`: a shared library, with wrappers for other programs
unity_export    `palpate export unity`: a package with the generic library, which check_engine asks
unreal_export   `palpate export unreal`: a plugin with the sources in C
engine_scene    what a scene of either needs to know; package_folder writes their folders
check_library   a library that answers through its Python wrapper
fmu_export      `palpate export fmu`: description, weights and the binaries of fmu_binaries, which read them
carried_mass    a mass at the tip of a body, which an FMU moves
check_fmu       an FMU that answers through FMPy
core            the C sources; templates: texts of exported files
umbridge_server a learnt file as a model of UM-Bridge, on this machine
gltf            a deforming surface as glTF with morph targets
answer_shapes   shapes of a surrogate without touch, coloured by a field
shape_files     shapes of datasets and of learnt bodies, as VTU series and glTF
"""

from palpate.export.answer_network import Choice
from palpate.export.c_export import ExportedC, export_c
from palpate.export.carried_mass import CarriedMass
from palpate.export.fmu_export import ExportedFmu, export_fmu
from palpate.export.lib_export import export_lib
from palpate.export.package_folder import ExportedPackage
from palpate.export.unity_export import export_unity
from palpate.export.unreal_export import export_unreal
from palpate.export.weights_block import WeightsBlock

__all__ = [
    "CarriedMass",
    "Choice",
    "ExportedC",
    "ExportedFmu",
    "ExportedPackage",
    "WeightsBlock",
    "export_c",
    "export_fmu",
    "export_lib",
    "export_unity",
    "export_unreal",
]
