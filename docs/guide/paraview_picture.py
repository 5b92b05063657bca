"""A picture of the last state of a run: particles coloured by a field, over the cells of the tree.

    pvbatch docs/guide/paraview_picture.py DIRECTORY/JOB FIELD PICTURE.png

ParaView's `pvbatch` runs this without a window. `xvfb-run -a` before it gives a machine without a display one.
"""
import sys

from paraview.simple import (
    ColorBy, CreateRenderView, GetAnimationScene, GetColorTransferFunction, GetScalarBar, OpenDataFile, ResetCamera,
    SaveScreenshot, Show,
)

name, field, picture = sys.argv[1:]
particles = OpenDataFile(name + ".hdf.series")
tree = OpenDataFile(name + ".tree.hdf.series")

times = list(particles.TimestepValues)
print("times", *(f"{time:.6g}" for time in times), "s")
view = CreateRenderView(ViewSize=[1200, 500], Background=[1, 1, 1])
view.UseColorPaletteForBackground = 0
view.OrientationAxesVisibility = 0
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.AnimationTime = times[-1]

points = Show(particles, view)
points.SetRepresentationType("Points")
points.PointSize = 3
ColorBy(points, ("POINTS", field))
colours = GetColorTransferFunction(field)
colours.ApplyPreset("Viridis (matplotlib)", True)
points.SetScalarBarVisibility(view, True)
bar = GetScalarBar(colours, view)
bar.TitleColor = bar.LabelColor = [0, 0, 0]
points.RescaleTransferFunctionToDataRange(False, True)

cells = Show(tree, view)
cells.SetRepresentationType("Wireframe")
cells.ColorArrayName = [None, ""]
cells.AmbientColor = cells.DiffuseColor = [0.6, 0.6, 0.6]
cells.Opacity = 0.5

ResetCamera(view)
view.CameraParallelProjection = 1
view.CameraParallelScale *= 0.6
SaveScreenshot(picture, view)
print("wrote", picture)
