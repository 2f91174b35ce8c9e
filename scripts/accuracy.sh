#!/usr/bin/env bash
# Makes every figure of docs/accuracy_tables.md: builds, measures the scenes with the reporting seeds, all
# series and the real frames, against splashsurf too, and puts the tables into the page.
#   scripts/accuracy.sh            everything: about twenty minutes on two cores
#   scripts/accuracy.sh --quick    a few scenes with one seed, the page left as it is: minutes
#   scripts/accuracy.sh --try      the smallest scene by a few methods: whether all steps work
# Results are in build/accuracy: main.html, violent.html, series.html and real.html are to be
# looked at.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
quick=${1:-}
if [[ -n $quick && $quick != --quick && $quick != --try ]]; then
  sed -n '2,8s/^# //p' "$0" >&2
  exit 2
fi

scripts/setup.sh
cmake --preset release -DMENISCUS_BUILD_BENCHMARKS=ON
cmake --build --preset release --target meniscus_accuracy_program
splashsurf=$(benchmarks/peers/splashsurf.sh)

out=build/accuracy
mkdir -p "$out"
program=build/release/meniscus-accuracy
methods=$("$program" --list-methods | paste -sd,)

measure() {  # NAME OPTION...
  echo "accuracy: $1, see $out/$1.html when it is done"
  "$program" "${@:2}" --json "$out/$1.json" --html "$out/$1.html" --markdown "$out/$1.md" \
    > "$out/$1.txt"
}

scenes=sphere,waves,boxpool,capsules,sheet  # for what takes many settings
main=(--seeds reporting)
violent=(--scene violent --seeds reporting)
series=(--series noise,lattice,spacing,orthographic,wide,narrow,jitter --scene "$scenes")
mesh=()
frames=(examples/data/dam/frame_015.ply examples/data/cube_drop/frame_007.ply)
if [[ $quick == --try ]]; then
  methods=fit
  main=(--seeds 1001 --scene sphere)
  violent=(--seeds 1001 --scene sphere)
  series=(--series jitter --scene sphere)
  mesh=(--scene sphere)
  frames=(examples/data/dam_sequence/dam.0010.ply)
elif [[ $quick ]]; then
  main=(--seeds 1001 --scene sphere,boxpool)
  violent=(--seeds 1001 --scene jet,gate)
  series=(--series noise,jitter --scene sphere,box)
  mesh=(--scene sphere,box)
  frames=(examples/data/cube_drop/frame_007.ply)
else
  frames+=(tests/data/splashsurf/dam_break_frame_9_6859_particles.bgeo examples/data/dam_sequence)
fi
all=(--method "$methods,splashsurf" --splashsurf "$splashsurf")

measure main "${main[@]}" "${all[@]}" --flicker --flicker-seeds 1
measure violent "${violent[@]}" "${all[@]}" --motion --flicker-seeds 1
measure series "${series[@]}" --seeds 1001 --method fit,ssm,narrow-range,anisotropic
measure mesh "${mesh[@]}" --seeds 1001 --method fit,ssm --mesh
measure real real "${frames[@]}" --particle-radius 0.025 "${all[@]}"

[[ $quick ]] && exit 0
awk '/^#### / { keep = /Mean/ }  # of the meshes nothing but their own figures
  keep && (!/^\|/ || /^\| (figure|mesh_|time)/ || /^\|-/)' "$out/mesh.md" > "$out/page.md"
mv "$out/page.md" "$out/mesh.md"
page=docs/accuracy_tables.md
for name in main violent series mesh real; do  # what lies between the markers of that name
  awk -v name="$name" -v tables="$out/$name.md" '
    $0 == "<!-- begin " name " -->" { print; while ((getline line < tables) > 0) print line; skip = 1 }
    $0 == "<!-- end " name " -->" { skip = 0 }
    !skip' "$page" > "$out/page.md"
  cp "$out/page.md" "$page"
done
echo "accuracy: $page has the new tables; look at $out/{main,violent,series,real}.html"
