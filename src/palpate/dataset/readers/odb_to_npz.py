"""Fields at the nodes of an Abaqus output database, written as an ``.npz`` that `palpate dataset import` reads.

    abaqus python odb_to_npz.py job.odb U NT11 [--instance PLATE-1] [--last]

Each frame of all steps is a case; with ``--last`` only the last one. Fields of integration points are extrapolated to
the nodes and averaged. The file has no units: name them in the mapping.
"""

import sys

import numpy as np

__all__ = ["convert", "main", "named_columns", "nodal_values"]


def nodal_values(field, region, labels):
    """Return a field at the nodes, (node, component), averaged over the elements that meet there."""
    from abaqusConstants import ELEMENT_NODAL, NODAL

    own = field.getSubset(region=region)
    nodal = [part for part in own.locations if part.position == NODAL]
    values = own.getSubset(position=NODAL if nodal else ELEMENT_NODAL).values
    index = dict((label, i) for i, label in enumerate(labels))
    width = max(1, len(field.componentLabels))
    total, count = np.zeros((len(labels), width)), np.zeros(len(labels))
    for value in values:
        i = index[value.nodeLabel]
        # in double precision Abaqus keeps the numbers elsewhere
        data = getattr(value, "dataDouble" if str(value.precision) == "DOUBLE_PRECISION" else "data")
        total[i] += np.ravel(data)
        count[i] += 1
    with np.errstate(invalid="ignore"):
        return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], np.nan)


def convert(path, names, instance_name=None, last=False):
    """Write PATH.npz and return its name."""
    from odbAccess import openOdb

    odb = openOdb(path, readOnly=True)
    try:
        instances = odb.rootAssembly.instances
        if instance_name is None and len(instances.keys()) != 1:
            raise SystemExit("Choose an instance with --instance: " + ", ".join(instances.keys()))
        instance = instances[instance_name or list(instances.keys())[0]]
        labels = [node.label for node in instance.nodes]
        arrays = {"points": np.array([node.coordinates for node in instance.nodes], dtype=float)}
        frames = [(step, frame) for step in odb.steps.values() for frame in step.frames]
        frames = frames[-1:] if last else frames
        arrays["time"] = np.array([step.totalTime + frame.frameValue for step, frame in frames])
        for name in names:
            missing = [frame for _, frame in frames if name not in frame.fieldOutputs.keys()]
            if missing:
                there = ", ".join(missing[0].fieldOutputs.keys())
                raise SystemExit("A frame has no field %s; it has %s" % (name, there))
            fields = [frame.fieldOutputs[name] for _, frame in frames]
            values = np.array([nodal_values(field, instance, labels) for field in fields])
            arrays.update(named_columns(name, fields[0].componentLabels, values))
    finally:
        odb.close()
    target = path.rpartition(".")[0] + ".npz"
    np.savez(target, **arrays)
    return target


def named_columns(name, components, values):
    """Return arrays by name: a vector as one, (case, node, k), components of a tensor apart, so that names stay."""
    if values.shape[2] == 1:
        return {name: values[:, :, 0]}
    if values.shape[2] in (2, 3) and not components[0].endswith("11"):
        return {name: values}
    return dict((name + "." + label[len(name) :], values[:, :, i]) for i, label in enumerate(components))


def main(words):
    """Read the words of the command line."""
    last, instance = "--last" in words, None
    words = [word for word in words if word != "--last"]
    if "--instance" in words:
        at = words.index("--instance")
        instance = words[at + 1]
        del words[at : at + 2]
    if len(words) < 2:
        raise SystemExit(__doc__)
    print(convert(words[0], words[1:], instance, last))


if __name__ == "__main__":
    main(sys.argv[1:])
