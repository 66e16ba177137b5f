# UNTESTED: nobody has run this recipe yet. Put it into a Spack repository of yours, packages/fetiplast/package.py, and please
# tell what was missing.
from spack.package import *


class Fetiplast(CargoPackage):
    """3D contact of elasto-plastic bodies by Total-FETI domain decomposition on MPI."""

    license("MIT OR Apache-2.0")

    # From a checkout: spack develop --path /path/to/fetiplast fetiplast@develop
    version("develop")

    depends_on("c", type="build")
    depends_on("rust@1.89:", type="build")
    # The bindings to MPI and HDF5 are made from their headers.
    depends_on("llvm+clang", type="build")
    depends_on("mpi")
    depends_on("hdf5+mpi")

    def setup_build_environment(self, env):
        env.set("MPICC", self.spec["mpi"].mpicc)
        env.set("HDF5_DIR", self.spec["hdf5"].prefix)
        env.set("LIBCLANG_PATH", self.spec["llvm"].prefix.lib)
