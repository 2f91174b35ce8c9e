#!/usr/bin/env python3
"""Writes a list of cameras that circle a point, for `meniscus extract 'dam.####.ply' --camera LIST`.

    orbit.py FRAMES TARGET DISTANCE [--turn DEGREES] [--size WxH] > cameras.json
    orbit.py 0-23 0.8,0.3,0.4 3.0 --turn 60 > cameras.json
"""
import argparse
import json
import math


def look_at(eye, target, up=(0, 1, 0)):
    """Rows of the 4x4 view matrix: world to eye space, the eye looks down -z."""
    def sub(a, b): return [a[k] - b[k] for k in range(3)]
    def dot(a, b): return sum(a[k] * b[k] for k in range(3))
    def cross(a, b): return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    def unit(a): return [x / math.sqrt(dot(a, a)) for x in a]
    back = unit(sub(eye, target))
    right = unit(cross(up, back))
    top = cross(back, right)
    return [[*axis, -dot(axis, eye)] for axis in (right, top, back)] + [[0, 0, 0, 1]]


def perspective(fov, aspect, near=0.1, far=100.0):
    f = 1 / math.tan(math.radians(fov) / 2)
    return [[f / aspect, 0, 0, 0], [0, f, 0, 0],
            [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)], [0, 0, -1, 0]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", help="first-last, e.g. 0-23")
    parser.add_argument("target", help="x,y,z that the cameras look at")
    parser.add_argument("distance", type=float, help="from it, world units")
    parser.add_argument("--turn", type=float, default=60, help="degrees from the first frame to the last")
    parser.add_argument("--start", type=float, default=-30, help="degrees of the first, 0: from +z")
    parser.add_argument("--height", type=float, default=25, help="degrees above the horizon")
    parser.add_argument("--fov", type=float, default=40, help="vertical, degrees")
    parser.add_argument("--size", default="1024x768", help="pixels")
    options = parser.parse_args()
    first, last = map(int, options.frames.split("-"))
    target = [float(x) for x in options.target.split(",")]
    width, height = map(int, options.size.split("x"))
    cameras = []
    for frame in range(first, last + 1):
        share = (frame - first) / max(1, last - first)
        azimuth = math.radians(options.start + options.turn * share)
        above = math.radians(options.height)
        offset = (math.sin(azimuth) * math.cos(above), math.sin(above), math.cos(azimuth) * math.cos(above))
        eye = [t + options.distance * o for t, o in zip(target, offset)]
        cameras.append({"frame": frame, "width": width, "height": height, "view": look_at(eye, target),
                        "projection": perspective(options.fov, width / height)})
    print(json.dumps(cameras))


if __name__ == "__main__":
    main()
