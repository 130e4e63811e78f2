"""Texts of the wrappers around an exported library: NAME stands for the name, CLASS for it as a class."""

from __future__ import annotations

__all__ = ["CSHARP", "MATLAB_EXAMPLE", "MATLAB_HEADER", "PYTHON", "UNREAL"]

PYTHON = '''"""NAME as a shared library, by ctypes alone: no numpy, no palpate.

    body = Body()                        # the library lies beside this file
    force, flags = body.force([0.0, 0.0, 0.01])

Places, forces and units are palpate's: SI units, right-handed frame.
"""

import ctypes
import pathlib
import sys

CONTACT, TRUSTED, NOT_A_NUMBER, TOO_DEEP = 1, 2, 4, 8
HASH = "@HASH@"


def _numbers(values, count):
    if len(values) != count:
        raise ValueError(f"{count} numbers are wanted, {len(values)} came")
    return (ctypes.c_double * max(count, 1))(*values)


class Body:
    """The body of one library; each object keeps its own memory."""

    def __init__(self, library=None):
        file = {"win32": "NAME.dll", "darwin": "libNAME.dylib"}.get(sys.platform, "libNAME.so")
        path = pathlib.Path(__file__).with_name(file) if library is None else library
        self._library = ctypes.CDLL(str(path))
        self._call("hash").restype = ctypes.c_char_p
        if self._call("hash")().decode() != HASH:
            raise ValueError(f"{path} holds other weights than this file is for")
        sizes = (ctypes.c_int32 * 8)()
        self._call("sizes")(sizes)
        self.inputs, self.felt, self.parameters, self._work, state, touch, self.nodes, self.components = sizes
        self._state, self._touch = (ctypes.c_double * max(1, state))(), (ctypes.c_double * max(1, touch))()
        self.remembers = state > 0

    def _call(self, name):
        return getattr(self._library, "NAME_" + name)

    def answer(self, place, parameters=()):
        """Return 19 numbers (energy, depth, force, stiffness, energy and offset, amplitude, its slope), flags."""
        out = (ctypes.c_double * 19)()
        flags = self._call("answer")(_numbers(place, 3), _numbers(parameters, self.parameters), out)
        return list(out), flags

    def energy(self, place, parameters=()):
        """Return the energy in J, and flags."""
        out, flags = self.answer(place, parameters)
        return out[0], flags

    def force(self, place, parameters=()):
        """Return the force on the hand in N, and flags."""
        out, flags = self.answer(place, parameters)
        return out[2:5], flags

    def force_jacobian(self, place, parameters=()):
        """Return the force, its derivative by the place row by row (N/m), and flags."""
        out, flags = self.answer(place, parameters)
        return out[2:5], out[5:14], flags

    def deviation(self, place, parameters=()):
        """Return the standard deviation of the force relative to its size."""
        out, work = ctypes.c_double(), (ctypes.c_double * self._work)()
        self._call("deviation")(_numbers(place, 3), _numbers(parameters, self.parameters), work, ctypes.byref(out))
        return out.value

    def start(self):
        """Go back to a body that nothing was done to."""
        self._call("start")(self._state)

    def step(self, seconds, place, parameters=()):
        """Move the hand within seconds; return the force of the body with its memory, and flags."""
        out = (ctypes.c_double * 3)()
        place, parameters = _numbers(place, 3), _numbers(parameters, self.parameters)
        flags = self._call("step")(self._state, place, parameters, ctypes.c_double(seconds), out)
        return list(out), flags

@RELEASE@    def release(self, seconds, place, parameters=()):
@RELEASE@        """Let go of the body at a place for seconds; return the place where it lies then, and flags."""
@RELEASE@        place, parameters = _numbers(place, 3), _numbers(parameters, self.parameters)
@RELEASE@        flags = self._call("release")(self._state, place, parameters, ctypes.c_double(seconds))
@RELEASE@        return list(place), flags
@RELEASE@
    @property
    def ledger(self):
        """Energies stored, lost so far, of the hand's work, and lost in the last step, in J."""
        return list(self._state[:4])

    def shape(self, place, parameters=(), first=0, count=None):
        """Return the field at nodes from `first` on, node by node."""
        count = self.nodes - first if count is None else count
        out = (ctypes.c_double * (count * self.components))()
        self._call("touched")(_numbers(place, 3), _numbers(parameters, self.parameters), self._touch)
        self._call("shape")(self._touch, ctypes.c_int32(first), ctypes.c_int32(count), out)
        return list(out)

    def limits(self):
        """Return low and high ends of the trained ranges."""
        low, high = (ctypes.c_double * self.inputs)(), (ctypes.c_double * self.inputs)()
        self._call("limits")(low, high)
        return list(low), list(high)
'''

CSHARP = """// NAME in Unity: put this file into Assets and the library into Assets/Plugins.
//
// Unity's frame is left-handed with y up, palpate's right-handed with z up, both in m: y and z change places.
// All vectors here are Unity's.
using System;
using System.Runtime.InteropServices;
using UnityEngine;

public sealed class CLASS
{
    [Flags] public enum Flags { None = 0, Contact = 1, Trusted = 2, NotANumber = 4, TooDeep = 8 }

    const string Library = "NAME", Hash = "@HASH@";
    [DllImport(Library)] static extern int NAME_answer(double[] x, double[] p, double[] answer);
    [DllImport(Library)] static extern int NAME_force(double[] x, double[] p, double[] force);
    [DllImport(Library)] static extern void NAME_sizes(int[] sizes);
    [DllImport(Library)] static extern void NAME_limits(double[] low, double[] high);
    [DllImport(Library)] static extern IntPtr NAME_hash();
@MEMORY@    [DllImport(Library)] static extern void NAME_start(double[] state);
@MEMORY@    [DllImport(Library)]
@MEMORY@    static extern int NAME_step(double[] state, double[] x, double[] p, double dt, double[] force);
@RELEASE@    [DllImport(Library)] static extern int NAME_release(double[] state, double[] x, double[] p, double dt);
@FIELD@    [DllImport(Library)] static extern int NAME_touched(double[] x, double[] p, double[] touch);
@FIELD@    [DllImport(Library)] static extern void NAME_shape(double[] touch, int first, int count, double[] values);

    readonly double[] x = new double[3], force = new double[3], state, touch, values;
    readonly int nodes, components;

    /// <summary>Inputs after the place, in their units.</summary>
    public readonly double[] Parameters;

    public CLASS()
    {
        if (Marshal.PtrToStringAnsi(NAME_hash()) != Hash)
            throw new InvalidOperationException("The library NAME holds other weights than this file is for.");
        var sizes = new int[8];
        NAME_sizes(sizes);
        Parameters = new double[Math.Max(1, sizes[2])];
        var low = new double[sizes[0]];
        var high = new double[sizes[0]];
        NAME_limits(low, high);
        for (int i = 0; i < sizes[2]; i++) Parameters[i] = (low[sizes[1] + i] + high[sizes[1] + i]) / 2;
        state = new double[Math.Max(1, sizes[4])];
        touch = new double[Math.Max(1, sizes[5])];
        nodes = sizes[6];
        components = sizes[7];
        values = new double[Math.Max(1, nodes * components)];
@MEMORY@        NAME_start(state);
    }

    static Vector3 ToUnity(double a, double b, double c) => new Vector3((float)a, (float)c, (float)b);

    void Take(Vector3 place) { x[0] = place.x; x[1] = place.z; x[2] = place.y; }

    /// <summary>Force on the hand in N at a place in m, both in the body's own frame.</summary>
    public Vector3 Force(Vector3 place, out Flags flags)
    {
        Take(place);
        flags = (Flags)NAME_force(x, Parameters, force);
        return (flags & Flags.TooDeep) != 0 ? Vector3.zero : ToUnity(force[0], force[1], force[2]);
    }
@MEMORY@
@MEMORY@    /// <summary>Force of the body with its memory; call it once in each FixedUpdate.</summary>
@MEMORY@    public Vector3 Step(Vector3 place, float seconds, out Flags flags)
@MEMORY@    {
@MEMORY@        Take(place);
@MEMORY@        flags = (Flags)NAME_step(state, x, Parameters, seconds, force);
@MEMORY@        return (flags & Flags.TooDeep) != 0 ? Vector3.zero : ToUnity(force[0], force[1], force[2]);
@MEMORY@    }
@MEMORY@
@RELEASE@    /// <summary>Let go of the body at a place; return where it lies after so many seconds.</summary>
@RELEASE@    public Vector3 Release(Vector3 place, float seconds, out Flags flags)
@RELEASE@    {
@RELEASE@        Take(place);
@RELEASE@        flags = (Flags)NAME_release(state, x, Parameters, seconds);
@RELEASE@        return ToUnity(x[0], x[1], x[2]);
@RELEASE@    }
@RELEASE@
@MEMORY@    public void Restart() { NAME_start(state); }
@FIELD@
@FIELD@    /// <summary>Add the displacement of a touch to the body's vertices at rest, in m.</summary>
@FIELD@    public void Deform(Vector3 place, Vector3[] rest, Vector3[] moved)
@FIELD@    {
@FIELD@        Take(place);
@FIELD@        NAME_touched(x, Parameters, touch);
@FIELD@        NAME_shape(touch, 0, nodes, values);
@FIELD@        for (int i = 0; i < nodes && components == 3; i++)
@FIELD@            moved[i] = rest[i] + ToUnity(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
@FIELD@    }
}
"""

UNREAL = """// NAME in Unreal: the sources or the library go into a module; include this header there.
//
// Unreal's frame is left-handed with z up, in cm; palpate's is right-handed with z up, in m: y changes its sign, and
// lengths are a hundred times as large. Forces are in N. The weights are @HASH@.
#pragma once
#include "NAME.h"

#ifdef __UNREAL__
#include "Math/Vector.h"
using CLASSVector = FVector;
#else
struct CLASSVector { double X, Y, Z; };
#endif

class CLASS
{
public:
    /** Inputs after the place, in their units. */
    double Parameters[NAME_PARAMETERS + 1] = {};

    CLASS()
    {
        double Low[NAME_INPUTS], High[NAME_INPUTS];
        NAME_limits(Low, High);
        for (int I = 0; I < NAME_PARAMETERS; I++) Parameters[I] = (Low[NAME_FELT + I] + High[NAME_FELT + I]) / 2;
@MEMORY@        NAME_start(&State);
    }

    /** Force on the hand in N at a place in cm; zero where the body lets go. */
    CLASSVector Force(const CLASSVector& Place, int32_t& Flags) const
    {
        const double X[3] = {0.01 * Place.X, -0.01 * Place.Y, 0.01 * Place.Z};
        double F[3];
        Flags = NAME_force(X, Parameters, F);
        return Turned(F, Flags);
    }
@MEMORY@
@MEMORY@    /** Force of the body with its memory; call it once a tick, with the tick's length in s. */
@MEMORY@    CLASSVector Step(const CLASSVector& Place, double Seconds, int32_t& Flags)
@MEMORY@    {
@MEMORY@        const double X[3] = {0.01 * Place.X, -0.01 * Place.Y, 0.01 * Place.Z};
@MEMORY@        double F[3];
@MEMORY@        Flags = NAME_step(&State, X, Parameters, Seconds, F);
@MEMORY@        return Turned(F, Flags);
@MEMORY@    }
@RELEASE@
@RELEASE@    /** Let go of the body, which was held at a place: where it lies after so many seconds. */
@RELEASE@    CLASSVector Release(const CLASSVector& Place, double Seconds, int32_t& Flags)
@RELEASE@    {
@RELEASE@        double X[3] = {0.01 * Place.X, -0.01 * Place.Y, 0.01 * Place.Z};
@RELEASE@        Flags = NAME_release(&State, X, Parameters, Seconds);
@RELEASE@        return CLASSVector{100.0 * X[0], -100.0 * X[1], 100.0 * X[2]};
@RELEASE@    }

private:
    static CLASSVector Turned(const double* F, int32_t Flags)
    {
        if (Flags & NAME_TOO_DEEP) return CLASSVector{0, 0, 0};
        return CLASSVector{F[0], -F[1], F[2]};
    }
@MEMORY@
@MEMORY@    NAME_state State;
};
"""

MATLAB_HEADER = """/* NAME for loadlibrary of MATLAB, which reads no conditions: see NAME_example.m */
int NAME_energy(double *x, double *p, double *energy);
int NAME_force(double *x, double *p, double *force);
int NAME_force_jacobian(double *x, double *p, double *force, double *jacobian);
int NAME_answer(double *x, double *p, double *answer);
int NAME_deviation(double *x, double *p, double *work, double *deviation);
void NAME_sizes(int *sizes);
void NAME_limits(double *low, double *high);
char *NAME_hash(void);
@MEMORY@void NAME_start(double *state);
@MEMORY@int NAME_step(double *state, double *x, double *p, double dt, double *force);
@RELEASE@int NAME_release(double *state, double *x, double *p, double dt);
@FIELD@int NAME_touched(double *x, double *p, double *touch);
@FIELD@void NAME_shape(double *touch, int first, int count, double *values);
"""

MATLAB_EXAMPLE = """% Load the library beside this file and ask for a force; palpate's frame and SI units.
if ispc, file = 'NAME'; else, file = 'libNAME'; end
loadlibrary(file, 'NAME_matlab.h');
x = @PLACE@;          % m
p = @PARAMETERS@;
[flags, ~, ~, force] = calllib(file, 'NAME_force', x, p, zeros(3, 1));
fprintf('force %g %g %g N, flags %d\\n', force, flags);
unloadlibrary(file);
"""
