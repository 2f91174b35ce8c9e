"""What scripts/run_docs.py must know of the documents' lines. A line that is not here runs as it stands.

Lines are spelled as in the document, without comments, continued lines joined, one blank between words.
"""

SECONDS = 300  # that one command may take
LONG = 20  # seconds: such a line of SMALLER runs once, not in every document that has it

FRAMES = "examples/data/dam_sequence"

# Files under the names that documents use, and what else must be there before: shell lines.
PREPARE = {
    "all": [
        f"cp {FRAMES}/dam.0010.ply frame.ply",
        f"cp {FRAMES}/camera.json camera.json",
        f"cp {FRAMES}/dam.00*.ply .",
    ],
    "README.md": ["cp tests/data/splashsurf/double_dam_break_frame_01_4732_particles.vtk frame.vtk"],
    "docs/batches.md": [
        "mkdir cache logs shards && cp dam.00*.ply cache && echo : > hosts",
        "for k in 1 2; do meniscus extract 'cache/dam.####.ply' -o 'shards/dam.####.png' --camera camera.json "
        "--shard $k/2 --log logs/$k.jsonl -q; done"],
    "docs/formats.md": [f"cp {FRAMES}/dam.00*.ply ."],
    "docs/large_frames.md": ["cp dam.0010.ply dam.rank0.ply && cp dam.0011.ply dam.rank1.ply"],
    "docs/library.md": [
        "for part in program library development static; do cmake --install $BUILD --prefix installed --component $part; done"],
    "docs/packages.md": [
        "for part in program library development static; do cmake --install $BUILD --prefix installed --component $part; done",
        "scripts/run_docs.py --block docs/library.md cpp > your_program.cpp"],
    "docs/reliability.md": ["mkdir -p build/mutants"],
    "docs/portability.md": [
        "cp examples/kernels/chain_sums.cl my.cl && cp examples/kernels/chain_sums.json my.json",
        "cp docs/runtime_flaws/zero_minus.* .",
        "meniscus verify -q --kernel cover_discs --size small --json old.json",
        # A driver that computes something else, so that there is a reproducer.
        "LD_PRELOAD=$BUILD/tests/libfaulty_kernel.so MENISCUS_FAULTY_KERNEL=find_fronts "
        "MENISCUS_FAULT='*(volatile global int*)(size_t)64 = 1;' "
        "meniscus verify -q --device cpu --kernel find_fronts --size small --repro reproducers || (($? == 1))"],
}

# line: (what is run instead, seconds that it takes or so, why). The same program with a smaller input.
ONE_KERNEL = "--kernel depth_normals --particles 1e3 --repetitions 2"
SHORT = "--frames 1 --seconds 0"
SMALLER = {
    "meniscus extract INPUT -o FILE": ("meniscus extract frame.ply -o surface.exr", 1, "names to fill in"),
    # The accuracy benchmark: twenty minutes in all.
    "scripts/accuracy.sh": ("scripts/accuracy.sh --try", 30, "twenty minutes"),
    "meniscus-accuracy --method paper,paper-best,paper+sigma-s=0.01,fit --seeds 1001": (
        "meniscus-accuracy --method paper,paper-best,paper+sigma-s=0.01,fit --seeds 1001 --scene sphere", 5, "minutes"),
    "meniscus-accuracy --method fit,groups --scene sphere,waves,box,boxpool,capsules,sheet --seeds 2 --flicker": (
        "meniscus-accuracy --method fit,groups --scene sphere --seeds 2 --flicker", 3, "minutes"),
    # Closed meshes: half an hour with OpenVDB, and whole frames.
    "meniscus-accuracy closed --scene calm,violent --seeds 1001 --cell 1,0.5 --beside-splashsurf "
    "--beside-openvdb build/peers/openvdb_mesh --meshes solids": (
        "meniscus-accuracy closed --scene sphere --seeds 1001 --cell 2 --meshes solids", 3, "half an hour"),
    "pip install numpy scipy trimesh manifold3d pymeshlab embreex pillow": (
        "pip install -q numpy scipy trimesh manifold3d embreex pillow", 10, "pymeshlab has 100 MB"),
    "benchmarks/peers/closed_frames.py frames": (
        "benchmarks/peers/closed_frames.py frames examples/data/cube_drop/frame_012.ply=0.025", 5, "time"),
    "scripts/mesh_pictures.py --width 520 rivals.png "
    "solids/crown_0_1001.ply:z:meniscus,solids/crown_4_1001.ply:z:splashsurf,solids/crown_5_1001.ply:z:OpenVDB "
    "frames/dam_frame_015_full.ply::meniscus,frames/dam_frame_015_splashsurf.ply::splashsurf,frames/dam_frame_015_openvdb.ply::OpenVDB "
    "frames/cube_drop_frame_012_full.ply::meniscus,frames/cube_drop_frame_012_splashsurf.ply::splashsurf,"
    "frames/cube_drop_frame_012_openvdb.ply::OpenVDB": (
        "scripts/mesh_pictures.py --width 60 rivals.png solids/sphere_0_1001.ply:z:meniscus,solids/sphere_1_1001.ply:z:meniscus "
        "frames/cube_drop_frame_012_full.ply:y:meniscus,frames/cube_drop_frame_012_splashsurf.ply:y:splashsurf", 5, "OpenVDB"),
    "scripts/mesh_pictures.py --width 640 --columns 1 --beside --wires few.png "
    "frames/cube_drop_frame_012_full.ply,frames/cube_drop_frame_012_adaptive.ply": (
        "scripts/mesh_pictures.py --width 60 --columns 1 --beside --wires few.png "
        "frames/cube_drop_frame_012_full.ply,frames/cube_drop_frame_012_adaptive.ply", 3, "time"),
    "meniscus-accuracy closed --scene calm,violent --seeds 1001 --cell 1": (
        "meniscus-accuracy closed --scene sphere --seeds 1001 --cell 1", 2, "minutes"),
    "meniscus-accuracy closed --series random --seeds 1,2 --cell 1": (
        "meniscus-accuracy closed --series random --seeds 1,2 --cell 1 --scene sphere", 3, "minutes"),
    "meniscus-accuracy closed --series random --seeds 1 --cell 1 --scene sphere,shortwaves,wall,jet,holes,breaker,sheet": (
        "meniscus-accuracy closed --series random --seeds 1 --cell 1 --scene sphere", 3, "minutes"),
    "meniscus-accuracy --method fit,groups --seeds reporting --flicker --flicker-seeds 1": (
        "meniscus-accuracy --method fit,groups --seeds 1001 --scene sphere --flicker --flicker-seeds 1", 5, "minutes"),
    "meniscus-accuracy --method fit fit+disorder=0 groups ssm bilateral curvature-flow anisotropic splashsurf --scene calm "
    "--seeds 1001 --noise .29": (
        "meniscus-accuracy --method fit fit+disorder=0 groups --scene sphere --seeds 1001 --noise .29", 2, "minutes, and splashsurf"),
    "meniscus-accuracy --method fit fit+disorder=0 ssm bilateral anisotropic --scene box,waves,capsules,crown,jet --seeds 1 --noise .1": (
        "meniscus-accuracy --method fit --scene box --seeds 1 --noise .1", 2, "minutes"),
    "meniscus-accuracy --series spacing --scene violent --seeds 1001 --method fit ssm anisotropic": (
        "meniscus-accuracy --series spacing --scene sphere --seeds 1001 --method fit", 3, "minutes"),
    "meniscus-accuracy --method fit --scene box,waves,capsules,crown --noise .29": (
        "meniscus-accuracy --method fit --scene box --seeds 1 --noise .29", 2, "half a minute"),
    "meniscus-accuracy --scene violent --seeds 1": ("meniscus-accuracy --scene crown --seeds 1 --method fit,ssm", 8, "minutes"),
    "meniscus-accuracy layers --scene calm,violent --seeds 1001": (
        "meniscus-accuracy layers --scene sphere --seeds 1001", 3, "minutes"),
    "meniscus-accuracy real FRAME --reference none --particle-radius 0.025": (
        "meniscus-accuracy real frame.ply --reference none --particle-radius 0.025 --method fit,ssm", 3, "minutes"),
    "benchmarks/accuracy/tune_rivals.py": (
        "benchmarks/accuracy/tune_rivals.py --seeds 1 --scenes box spheres", 5, "hours"),
    # Pictures and tables.
    "scripts/figure6.sh": ("scripts/figure6.sh 1", 10, "five rounds take minutes"),
    "scripts/gallery.sh": ("scripts/gallery.sh build/gallery cube_drop_frame_012", 20, "minutes"),
    "scripts/real_frames.sh": (f"scripts/real_frames.sh {FRAMES}/dam.0010.ply", 20, "three frames take minutes"),
    # Batches.
    "benchmarks/overlap.py": (
        f"benchmarks/overlap.py $BUILD/meniscus '{FRAMES}/dam.####.ply' camera.json --rounds 1 -- --aov N", 5, "needs arguments"),
    "meniscus extract 'cache/dam.####.ply' -o 'out/dam.####.exr' --camera camera.json --resume -q "
    "--frames #FRAME_START#-#FRAME_END#": (
        "meniscus extract 'cache/dam.####.ply' -o 'out/dam.####.exr' --camera camera.json --resume -q --frames 8-9", 1,
        "Cuebot puts the numbers in"),
    "mpirun -n 4 meniscus extract 'dam.####.ply' ...": (
        "mpirun -n 2 meniscus extract 'dam.####.ply' -o 'mpi.####.ply' --camera camera.json", 2, "two processors"),
    # Large frames.
    "meniscus generate --particles 1e8 -o large.ply": ("meniscus generate --particles 3e5 -o large.ply", 1, "1.2 GB"),
    "meniscus generate --particles 1e7 -o dam.ply": ("meniscus generate --particles 3e5 -o dam.ply", 1, "120 MB"),
    "mpirun -n 64 --map-by ppr:1:node --bind-to none meniscus extract 'dam.rank*.ply' -o dam.exr": (
        "mpirun -n 2 --bind-to none meniscus extract 'dam.rank*.ply' -o dam.exr", 2, "one machine"),
    "benchmarks/scaling.py": ("benchmarks/scaling.py --largest 1e4 --runs 1 --sizes 320x240", 2, "10^8 particles"),
    # Building: all is built already.
    "g++ -std=c++20 your_program.cpp $(pkg-config --cflags --libs meniscus)": (
        "export PKG_CONFIG_PATH=$(dirname $(find $PWD/installed -name meniscus.pc)) && "
        "g++ -std=c++20 your_program.cpp $(pkg-config --cflags --libs meniscus) && "
        "LD_LIBRARY_PATH=$(dirname $PKG_CONFIG_PATH) ./a.out", 5, "installed in a folder of its own"),
    "cmake --install build/release --prefix PREFIX": (
        "cmake --install build/release --prefix prefix --component program", 1, "names to fill in"),
    "ctest --preset release -L fast": ("ctest --preset release -L fast -R '^CameraJson'", 2, "scripts/test.sh runs all"),
    "ctest -R NAME": ("ctest --preset release -R '^CameraJson'", 2, "names to fill in"),
    "scripts/usd_sequence.py": (
        "pip install -q usd-core numpy && scripts/usd_sequence.py --help", 5, "needs arguments, which the block has"),
    # Benchmarks of frames and kernels: minutes.
    "meniscus bench frame": (f"meniscus bench frame --method ssm {SHORT}", 2, "two minutes"),
    "meniscus bench frame --method fit,groups,ssm,paper": (f"meniscus bench frame --method groups,paper {SHORT}", 3, "half a minute"),
    "meniscus bench frame --particles 1e7 --size 1920x1080 --method fit": (
        f"meniscus bench frame --particles 1e5 --size 1920x1080 --method fit {SHORT}", 3, "half a minute"),
    "meniscus bench frame --method fit,ssm --json frames.json": (
        f"meniscus bench frame --method fit,ssm --json frames.json {SHORT}", 2, "time"),
    "meniscus bench frame --sweep --method fit": (
        f"meniscus bench frame --sweep --method ssm {SHORT} --in-flight 1", 5, "time"),
    "meniscus bench frame --threads 1 --method fit": (f"meniscus bench frame --threads 1 --method fit {SHORT}", 2, "time"),
    "meniscus bench frame --method fit --json": (f"meniscus bench frame --method fit --json - {SHORT}", 2, "time"),
    "meniscus bench --html page.html --json new.json": (
        f"meniscus bench --html page.html --json new.json {ONE_KERNEL} && cp new.json old.json", 2, "minutes"),
    "meniscus bench --compare old.json": (f"meniscus bench --compare old.json {ONE_KERNEL}", 2, "minutes"),
    "meniscus bench --kernel fit_particles,blend_groups --particles 1e3,1e4,1e5 --size 1920x1080": (
        "meniscus bench --kernel fit_particles,blend_groups --particles 1e3 --size 640x480 --repetitions 2", 3, "minutes"),
    "meniscus bench --kernel owners_by,fronts_by,spheres_by --particles 40000": (
        "meniscus bench --kernel owners_by,fronts_by,spheres_by --particles 1e3 --repetitions 2", 3, "minutes"),
    "meniscus tune": ("meniscus tune --rounds 1", 8, "half a minute"),
    # Verify: half a minute a line.
    "meniscus verify --device gpu --html gpu.html": (
        "meniscus verify --device cpu --html cpu.html --kernel cover_discs --size small", 2, "no GPU here"),
    "meniscus verify": ("meniscus verify --size small --kernel cover_discs", 2, "half a minute"),
    "meniscus verify --kernel fit_particles": ("meniscus verify --kernel fit_particles --size small", 5, "time"),
    "meniscus verify --size small": ("meniscus verify --size small --kernel find_fronts", 5, "time"),
    "meniscus verify --json new.json --junit new.xml": (
        "meniscus verify --json new.json --junit new.xml --kernel cover_discs --size small", 2, "time"),
    "meniscus verify --repeat 20": ("meniscus verify --repeat 2 --kernel cover_discs --size small", 2, "time"),
    "meniscus verify --repro DIR": ("meniscus verify --repro DIR --kernel cover_discs --size small", 2, "time"),
    "make && ./host": ("cd $(ls -d reproducers/*/ | head -1) && make && ./host", 2, "the folder"),
    "./host GPU 100": ("cd $(ls -d reproducers/*/ | head -1) && ./host pthread 10", 2, "no GPU here"),
    "meniscus extract --timings": ("meniscus extract frame.ply -o timed.png --timings", 1, "an option"),
    # Reliability.
    "scripts/mutants.py": ("scripts/mutants.py list", 1, "needs arguments"),
    # Python.
    "apt-get install ocl-icd-libopencl1": ("apt-get install --simulate ocl-icd-libopencl1", 1, "changes the system"),
}

# Lines that end with another exit code than 0, as the document says.
EXIT_CODES = {}

# line: a program that packages.txt does not install: the line runs where the program is there.
WHERE_THERE_IS = {
    "parallel --sshloginfile hosts --workdir . --halt never --resume-failed --joblog jobs.txt "
    "meniscus extract \"'cache/dam.####.ply'\" -o \"'out/dam.####.exr'\" --camera camera.json --resume "
    "--shard {}/8 --log logs/{}.jsonl ::: $(seq 8)": "parallel",
    "PYTHON=python3.11 scripts/python_wheel.sh build/release": "python3.11",
    "examples/blender/build.sh build/wheels/meniscus_surface-*-cp311-*.whl meniscus_cache.zip": "python3.11",
}

# line: (script, what stands in it). The script is part of .ci/run or .ci/nightly.
ELSEWHERE = {
    "scripts/test.sh": (".ci/run", "part scripts/test.sh"),
    "scripts/run_docs.py": (".ci/parts.sh", "part scripts/run_docs.py"),
    "scripts/sanitized.sh": (".ci/nightly", "part scripts/sanitized.sh"),
    "scripts/fuzz.sh build/asan": (".ci/nightly", "part scripts/fuzz.sh build/asan"),
    "scripts/fuzz.sh": (".ci/nightly", "part scripts/fuzz.sh"),
    "scripts/test.sh --long": (".ci/nightly", "part scripts/test.sh --long"),
    "scripts/check_outputs.sh build/release": (".ci/run", "part scripts/check_outputs.sh build/release"),
    "scripts/check_outputs.sh BUILD": (".ci/run", "part scripts/check_outputs.sh build/release"),
    "scripts/python_test.sh build/release": (".ci/run", "part scripts/python_test.sh build/release"),
    "scripts/package_test.sh build/release": (".ci/run", "part scripts/package_test.sh build/release"),
    "scripts/batch_test.sh": (".ci/run", "part scripts/batch_test.sh"),
    "scripts/failing_calls.sh build/release 47": (".ci/run", "part scripts/failing_calls.sh build/release"),
    "scripts/failing_calls.sh BUILD": (".ci/run", "part scripts/failing_calls.sh build/release"),
    "scripts/failing_calls.sh": (".ci/run", "part scripts/failing_calls.sh"),
    "pip install .": ("scripts/python_test.sh", "wheel . --no-deps"),
    "python -m meniscus": ("scripts/python_test.sh", "-m pytest"),
    "man meniscus": ("scripts/package_test.sh", "man --warnings"),
}

# What cannot run here, and why.
NEVER = {
    "meniscus tune --device all": "meniscus tune runs for one device; the other line for all, of which there is one here",
    "meniscus bench": "meniscus bench --html page.html --json new.json runs, with one kernel",
    "meniscus bench --particles 40000": "the lines with --kernel and --particles run",
    "meniscus bench --device all --compare old.json": "the line for one device runs",
    "scripts/figure5.sh": "scripts/figure6.sh runs the same script, figure.sh, on a smaller frame",
    "scripts/figure_cube.sh": "scripts/figure6.sh runs the same script, figure.sh, on a smaller frame",
    "srun --mpi=pmix --ntasks-per-node=1 --kill-on-bad-exit meniscus extract 'dam.rank*.ply' -o dam.exr": "needs Slurm",
    "srun --gpus-per-task=1": "needs Slurm",
    "scripts/slurm/submit.sh 8 logs --time=2:00:00 -- 'cache/dam.####.ply' -o 'out/dam.####.exr' --camera camera.json":
        "needs Slurm; scripts/slurm/test.sh tries it by hand",
    "scripts/slurm/test.sh": "installs Slurm and munge as services of the machine",
    "mpirun -q": "an option of mpirun",
    "scripts/test.sh asan": "all tests under the sanitizers take an hour; scripts/sanitized.sh runs the fast ones",
    "benchmarks/peers/newton_surface.py": "needs newton and Warp from PyPI, and a GPU of NVIDIA's",
    "benchmarks/peers/run.sh": "needs VTK with EGL",
    "benchmarks/peers/openvdb.sh": "needs OpenVDB's headers",
    "scripts/mesh_check.py --apart frames/dam_frame_015_full.ply frames/dam_frame_015_adaptive.ply 0.025": "needs pymeshlab, 100 MB",
    "scripts/mesh_kills.sh build/release/meniscus": "a minute of kills; scripts/batch_test.sh has those of extract",
    "scripts/format_samples.py": "needs VTK, meshio, h5py and blosc; tests/data/formats has what it writes",
    "pip install '.[cpu]'": "800 MB",
    "scripts/debian.sh": "sets up another system as root, ten minutes",
    "scripts/debian.sh trixie": "sets up another system as root, ten minutes",
    "scripts/portability.sh": "builds all kernels anew for each runtime, minutes, and downloads 1 GB of them",
    "oclgrind --data-races": "an option; ctest's Kernels.AreCleanUnderOclgrind runs every kernel with it",
    "scripts/python_wheel.sh": "without a build folder it builds the library anew, minutes; the line with one runs",
    "scripts/mutants.py run --build build/release --out build/mutants":
        "begins with all cases of verify, which takes minutes, before the first mutant",
    "scripts/mutants.py run --build build/release --out build/mutants --quick --file settle.cl blend.cl":
        "begins with all cases of verify, which takes minutes, before the first mutant",
    "python3.11 examples/blender/render_frame.py 'dam.####.ply' 12 out.png":
        "needs bpy, 400 MB; scripts/blender_test.sh runs it by hand",
    "scripts/record_canonical.sh": "writes the canonical bits, on a whole verify; ctest's Recording.* run its command",
}

# Of a document: (language of its block, the shell lines that run it).
CONSUMER = (
    "mkdir consumer && scripts/run_docs.py --block docs/library.md cpp > consumer/your_program.cpp && "
    "(echo 'cmake_minimum_required(VERSION 3.25)'; echo 'project(consumer CXX)'; "
    "echo 'add_executable(your_program your_program.cpp)'; scripts/run_docs.py --block {document} cmake) "
    "> consumer/CMakeLists.txt && "
    "cmake -S consumer -B consumer/build -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=$PWD/installed && "
    "cmake --build consumer/build && consumer/build/your_program && test -s surface.png && test -s surface.ply")
BLOCKS = {
    "docs/library.md": [("cpp", CONSUMER.format(document="docs/library.md"))],
    "docs/packages.md": [("cmake", CONSUMER.format(document="docs/packages.md"))],
}
