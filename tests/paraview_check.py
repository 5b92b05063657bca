"""Opens files with ParaView as a double click does: ParaView chooses the reader by the name. Prints one JSON object
per file. Run by ParaView's own interpreter:

    pvbatch tests/paraview_check.py FILE.hdf.series FILE.hdf ...
"""
import json
import sys

from paraview import simple


def arrays(attributes):
    return {attributes[i].GetName(): attributes[i].GetNumberOfComponents() for i in range(len(attributes))}


def at(source, time):
    """What the source holds at a time of its own, with the time that the file states."""
    source.UpdatePipeline(time)
    stated = source.FieldData["TimeValue"]
    return {
        "time": stated.GetRange()[0] if stated else None,
        "points": source.GetDataInformation().GetNumberOfPoints(),
        "cells": source.GetDataInformation().GetNumberOfCells(),
        "point_fields": arrays(source.PointData),
        "cell_fields": arrays(source.CellData),
    }


for path in sys.argv[1:]:
    source = simple.OpenDataFile(path)
    times = list(source.TimestepValues or [])
    states = [at(source, time) for time in times or [0.0]]
    print(json.dumps({"file": path, "version": str(simple.GetParaViewVersion()), "times": times, "states": states}))
