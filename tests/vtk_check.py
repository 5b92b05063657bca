#!/usr/bin/env python3
"""Reads output files with VTK's own reader and prints what it found, one JSON object per file.

    vtk_check.py FILE.hdf ...
    vtk_check.py FILE.htg ...
    vtk_check.py NAME.hdf.series    checks that each file of the series opens and has its time
"""
import json
import os
import sys

# Module by module: "import vtk" also loads those that draw, which need libraries that small systems lack.
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.util.vtkConstants import VTK_STRING
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkCellTypes, vtkHyperTreeGridNonOrientedCursor
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLHyperTreeGridReader


def arrays(attributes):
    found = {}
    for i in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(i)
        values = vtk_to_numpy(array)
        found[array.GetName()] = {
            "tuples": array.GetNumberOfTuples(),
            "components": array.GetNumberOfComponents(),
            "type": array.GetDataTypeAsString(),
            "sum": float(values.sum()) if values.size else 0.0,
        }
    return found


def read(path):
    errors = []
    reader = vtkHDFReader()
    if not reader.CanReadFile(path):
        raise SystemExit(f"{path}: VTK cannot read this file")
    observer = lambda *args: errors.append(str(args[-1]))
    observer.CallDataType = VTK_STRING
    reader.AddObserver("ErrorEvent", observer)
    reader.SetFileName(path)
    reader.Update()
    if errors:
        raise SystemExit(f"{path}: {errors[0]}")
    grid = reader.GetOutput()
    types = vtkCellTypes()
    grid.GetCellTypes(types)
    return {
        "file": path,
        "vtk": vtkVersion.GetVTKVersion(),
        "class": grid.GetClassName(),
        "points": grid.GetNumberOfPoints(),
        "cells": grid.GetNumberOfCells(),
        "cell_types": sorted(types.GetCellType(i) for i in range(types.GetNumberOfTypes())),
        "bounds": list(grid.GetBounds()) if grid.GetNumberOfPoints() else [],
        "point_data": arrays(grid.GetPointData()),
        "cell_data": arrays(grid.GetCellData()),
        "field_data": arrays(grid.GetFieldData()),
    }


def read_tree(path):
    """A HyperTreeGrid: sums of its fields over the leaves, which a cursor finds."""
    reader = vtkXMLHyperTreeGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    data = grid.GetCellData()
    fields = {data.GetArray(i).GetName(): data.GetArray(i) for i in range(data.GetNumberOfArrays())}
    sums = dict.fromkeys(fields, 0.0)
    cursor = vtkHyperTreeGridNonOrientedCursor()
    leaves = 0

    def visit():
        nonlocal leaves
        if cursor.IsLeaf():
            leaves += 1
            for name, array in fields.items():
                sums[name] += array.GetTuple1(cursor.GetGlobalNodeIndex())
            return
        for child in range(cursor.GetNumberOfChildren()):
            cursor.ToChild(child)
            visit()
            cursor.ToParent()

    for tree in range(grid.GetMaxNumberOfTrees()):
        grid.InitializeNonOrientedCursor(cursor, tree)
        visit()
    time = grid.GetFieldData().GetArray("TimeValue")
    return {
        "file": path,
        "vtk": vtkVersion.GetVTKVersion(),
        "leaves": leaves,
        "bounds": list(grid.GetBounds()),
        "sums_of_leaves": sums,
        "time": time.GetTuple1(0) if time else None,
    }


def main():
    for path in sys.argv[1:]:
        if path.endswith(".htg"):
            print(json.dumps(read_tree(path)))
            continue
        if not path.endswith(".series"):
            print(json.dumps(read(path)))
            continue
        with open(path) as text:
            series = json.load(text)
        times = [entry["time"] for entry in series["files"]]
        if times != sorted(set(times)):
            raise SystemExit(f"{path}: times do not increase: {times}")
        for entry in series["files"]:
            found = read(os.path.join(os.path.dirname(path), entry["name"]))
            stated = found["field_data"]["TimeValue"]["sum"]
            if stated != entry["time"]:
                raise SystemExit(f"{path}: {entry['name']} has time {stated}, not {entry['time']}")
        print(json.dumps({"series": path, "times": times}))


main()
