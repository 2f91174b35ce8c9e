"""Times VTK's fluid mapper (vtkOpenGLFluidMapper, narrow-range filter) on one frame, off screen.

  vtk_frame.py PARTICLES.ply CAMERA.json RUNS [PICTURE.png]

Surface only: the filtered surface's normals, without thickness and colours. A frame is new
particles in memory to the picture in memory.
"""

import json
import sys

import frame
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk


def make_camera(description):
    """The OpenGL camera of the JSON: view matrix, and a symmetric perspective projection."""
    view, p = np.array(description["view"]), np.array(description["projection"])
    eye = -view[:3, :3].T @ view[:3, 3]
    camera = vtk.vtkCamera()
    camera.SetPosition(*eye)
    camera.SetFocalPoint(*(eye - view[2, :3]))
    camera.SetViewUp(*view[1, :3])
    camera.SetViewAngle(float(np.degrees(2 * np.arctan(1 / p[1, 1]))))
    near, far = p[2, 3] / (p[2, 2] - 1), p[2, 3] / (p[2, 2] + 1)
    camera.SetClippingRange(near, far)
    return camera


def main():
    positions, radius = frame.read_ply(sys.argv[1])
    with open(sys.argv[2]) as file:
        description = json.load(file)
    width, height = description["width"], description["height"]
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(positions))
    fluid = vtk.vtkPolyData()
    fluid.SetPoints(points)
    vertices = vtk.vtkCellArray()
    for i in range(len(positions)):
        vertices.InsertNextCell(1, [i])
    fluid.SetVerts(vertices)

    mapper = vtk.vtkOpenGLFluidMapper()
    mapper.SetInputData(fluid)
    mapper.SetParticleRadius(1.5 * radius)
    mapper.SetSurfaceFilterMethod(vtk.vtkOpenGLFluidMapper.NarrowRange)
    mapper.SetSurfaceFilterRadius(5)  # VTK's defaults
    mapper.SetSurfaceFilterIterations(3)
    mapper.SetThicknessAndVolumeColorFilterIterations(0)
    mapper.SetDisplayMode(vtk.vtkOpenGLFluidMapper.FilteredSurfaceNormal)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(volume)
    renderer.SetActiveCamera(make_camera(description))
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    pixels = vtk.vtkUnsignedCharArray()

    def render():
        points.Modified()  # new particles
        fluid.Modified()
        window.Render()
        window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)

    render()  # builds the shaders
    covered = np.frombuffer(pixels, np.uint8).reshape(-1, 3).any(axis=1).sum()
    renderers = [line.split(":", 1)[1].strip() for line in window.ReportCapabilities().split("\n")
                 if line.startswith("OpenGL renderer")]
    frame.report(render, int(sys.argv[3]), version=vtk.vtkVersion.GetVTKVersion(),
                 window=window.GetClassName(), renderer=renderers[0] if renderers else "",
                 pixels=int(covered))

    if len(sys.argv) > 4:
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(window)
        writer = vtk.vtkPNGWriter()
        writer.SetFileName(sys.argv[4])
        writer.SetInputConnection(grab.GetOutputPort())
        writer.Write()


main()
