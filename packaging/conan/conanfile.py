"""KSL for C and C++.  conan create packaging/conan; in ConanCenter, sources come from the release's archive (conandata.yml) instead."""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir

ROOT = os.path.join("..", "..")


class Ksl(ConanFile):
    name = "ksl"
    license = "BSD-3-Clause"
    description = "Every wrench in a mechanism: spatial algebra, rigid-body dynamics, joint reactions"
    topics = ("robotics", "dynamics", "multibody", "spatial-algebra")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fetch_pugixml": [True, False], "instruction_sets": ["all", "native", "x86_64_v2", "x86_64_v3", "x86_64_v4"]}
    default_options = {"shared": False, "fetch_pugixml": False, "instruction_sets": "all"}

    def set_version(self):
        self.version = re.search(r'#define KSL_VERSION "(.+)"', load(self, os.path.join(self.recipe_folder, ROOT, "include/ksl/config.h")))[1]

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "src/*"):
            copy(self, pattern, os.path.join(self.recipe_folder, ROOT), self.export_sources_folder)

    def requirements(self):
        if not self.options.fetch_pugixml:
            self.requires("pugixml/1.13")

    def validate(self):
        check_min_cppstd(self, 20)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["KSL_FETCH_PUGIXML"] = bool(self.options.fetch_pugixml)
        toolchain.cache_variables["KSL_INSTRUCTION_SETS"] = str(self.options.instruction_sets)
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        for folder in ("lib/cmake", "lib/pkgconfig"):  # Conan writes its own
            rmdir(self, os.path.join(self.package_folder, folder))
        unwanted = ".a" if self.options.shared else ".so"
        for name in os.listdir(os.path.join(self.package_folder, "lib")):
            if unwanted in name:
                os.remove(os.path.join(self.package_folder, "lib", name))

    def package_info(self):
        self.cpp_info.components["algebra"].libs = ["ksl_algebra"]
        self.cpp_info.components["algebra"].set_property("cmake_target_name", "ksl::algebra")
        self.cpp_info.components["ksl"].libs = ["ksl"]
        self.cpp_info.components["ksl"].set_property("cmake_target_name", "ksl::ksl")
        if not self.options.fetch_pugixml:
            self.cpp_info.components["ksl"].requires = ["pugixml::pugixml"]
        if self.settings.os in ("Linux", "FreeBSD"):
            self.cpp_info.components["algebra"].system_libs = ["m"]
            self.cpp_info.components["ksl"].system_libs = ["m", "pthread"]
