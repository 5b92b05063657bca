"""A recipe for Spack: agimp from the archive of sources of a release, with the crates inside, so that no network is needed.

It goes into a repository of packages as packages/agimp/package.py (`spack repo create`); then `spack install agimp`.
jobs/packaging/release writes the sum of the archive and the address into a copy in target/packages/recipes.
docs/releasing.md says how far it has been tried.
"""

from spack_repo.builtin.build_systems.cargo import CargoPackage

from spack.package import *


class Agimp(CargoPackage):
    """Adaptive generalized interpolation material point method on a distributed octree: solids, soil, sand, snow and fluids
    at large deformation."""

    homepage = "https://example.org/agimp"
    url = "https://example.org/agimp/releases/download/v0.1.0/agimp-0.1.0-sources.tar.xz"

    license("MIT OR Apache-2.0")

    version("0.1.0", sha256="0000000000000000000000000000000000000000000000000000000000000000")

    variant("mpi", default=True, description="Ranks; without it one process with threads, with the same results")

    depends_on("c", type="build")
    depends_on("rust@1.95:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("hdf5@1.10:")
    with when("+mpi"):
        depends_on("mpi")
        depends_on("hdf5+mpi")
        depends_on("llvm+clang", type="build")  # libclang: the bindings are made from the headers of MPI
    depends_on("hdf5~mpi", when="~mpi")

    # .cargo/config.toml asks for AVX2 and FMA
    requires("target=x86_64_v3:", when="target=x86_64:", msg="agimp needs AVX2 and FMA")

    @property
    def build_args(self):
        args = ["--locked", "--offline"]
        if self.spec.satisfies("~mpi"):
            args += ["--no-default-features", "--features", "post"]
        return args

    def setup_build_environment(self, env):
        env.set("HDF5_DIR", self.spec["hdf5"].prefix)
        if self.spec.satisfies("+mpi"):
            env.set("LIBCLANG_PATH", self.spec["llvm"].prefix.lib)

    @run_after("install")
    def start_it(self):
        Executable(self.prefix.bin.agimp)("--version")
