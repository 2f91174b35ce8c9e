# A recipe for Spack: put this folder at packages/meniscus in a repository of yours, the source archive
# (cpack --config CPackSourceConfig.cmake) beside it, and
#   spack install meniscus
from spack.package import *


class Meniscus(CMakePackage):
    """Particles of a fluid simulation in, the surface that a camera sees out, on any OpenCL device."""

    # No network: the archive lies beside this file.
    version("0.1.0", url="file://{0}/meniscus-0.1.0.tar.gz".format(__file__.rpartition("/")[0]))

    license("GPL-3.0-or-later")

    variant("shared", default=True, description="The library as a shared one")
    variant("mpi", default=False, description="One frame on several machines")
    variant("python", default=False, description="The Python package")

    depends_on("cxx", type="build")
    depends_on("c", type="build", when="+mpi")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("python", type="build")  # man pages
    depends_on("opencl@1.2:")
    depends_on("opencl-c-headers")
    depends_on("opencl-clhpp")
    depends_on("c-blosc@1.21:")
    depends_on("cgal@5.4:")
    depends_on("cli11@2.1:", type="build")
    depends_on("eigen@3.4:", type="build")
    depends_on("intel-tbb@2021:")  # Spack's name of oneTBB
    depends_on("libdeflate")
    depends_on("libpng")
    depends_on("nlohmann-json@3.11:", type="build")
    depends_on("openexr@3.1:")
    depends_on("xxhash", type="build")
    depends_on("zlib-api")
    depends_on("mpi", when="+mpi")
    with when("+python"):
        extends("python@3.10:")
        depends_on("py-pip", type="build")
        depends_on("py-scikit-build-core@0.11:", type="build")
        depends_on("py-nanobind@2.7:", type="build")
        depends_on("py-numpy", type=("build", "run"))

    generator("ninja")

    def cmake_args(self):
        return [
            self.define_from_variant("MENISCUS_SHARED", "shared"),
            self.define_from_variant("MENISCUS_MPI", "mpi"),
            self.define("MENISCUS_BUILD_TESTS", False),
        ]

    @run_after("install", when="+python")
    def install_python(self):
        pip = which("python3", required=True)
        pip("-m", "pip", "install", "--no-deps", "--no-build-isolation", "--prefix", self.prefix,
            "-C", "cmake.define.MENISCUS_INSTALLED={0}".format(self.prefix), self.stage.source_path)
