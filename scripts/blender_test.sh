#!/usr/bin/env bash
# Runs the Blender extension without Blender's windows: plays a sequence, and renders a frame with and
# without motion blur. Installs bpy from PyPI (some 400 MB), which is for one version of Python alone, so
# that continuous integration leaves this out.
#   scripts/blender_test.sh WHEEL [FOLDER]
# WHEEL: of scripts/python_wheel.sh for that Python. FOLDER: where pictures go. PYTHON: bpy's (python3.11).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
wheel=$(realpath "$1") folder=$(realpath -m "${2:-build/blender}")
mkdir -p "$folder"
home=build/python/blender
if [[ ! -e $home/ready ]]; then
  "${PYTHON:-python3.11}" -m venv "$home"
  "$home/bin/pip" -q --disable-pip-version-check install bpy
  touch "$home/ready"
fi
"$home/bin/pip" -q --disable-pip-version-check install --no-deps --force-reinstall "$wheel"
frames=$PWD/examples/data/dam_sequence/dam.####.ply

"$home/bin/python" -W ignore - "$frames" <<'END'
import sys

sys.path.insert(0, "examples/blender")
import bpy
import meniscus_cache

bpy.ops.wm.read_factory_settings(use_empty=True)
meniscus_cache.register()
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = 160, 120
eye = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
eye.location = 0, 0, 8
scene.collection.objects.link(eye)
scene.camera = eye
bpy.context.view_layer.update()
bpy.ops.object.meniscus_cache(filepath=sys.argv[1])
shown = bpy.data.objects["Surface"]
counts = []
for frame in (8, 10, 12, 99):
    scene.frame_set(frame)
    mesh = shown.data
    counts.append(len(mesh.polygons))
    assert not mesh.validate(), f"frame {frame} is not a valid mesh"
    if frame < 99:
        assert mesh.attributes["velocity"].domain == "POINT"
        assert len(mesh.attributes["velocity"].data) == len(mesh.vertices)
assert counts[-1] == 0 and len(set(counts)) == 4, counts
meniscus_cache.unregister()
print("triangles of frames 8, 10, 12 and of one that is not there:", counts)
END

for kind in blurred still; do
  "$home/bin/python" -W ignore examples/blender/render_frame.py "$frames" 12 "$folder/$kind.png" \
    --size 400x300 --samples 16 $([[ $kind == blurred ]] || echo --still) | tail -1
done
"$home/bin/python" -W ignore - "$folder" <<'END'
import sys

import bpy
import numpy as np

def picture(name):
    image = bpy.data.images.load(f"{sys.argv[1]}/{name}.png")
    return np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]

blurred, still = picture("blurred"), picture("still")
difference = np.abs(blurred - still).mean(axis=-1)
# Splash flies up at the right, the tank's left end hardly moves: rows from below, columns from the left.
fast, slow = difference[150:250, 220:320].mean(), difference[60:150, 100:180].mean()
print(f"mean difference where the splash flies {fast:.4f}, at the other end {slow:.4f}")
assert fast > 3 * slow  # whose difference is noise, mostly
END
