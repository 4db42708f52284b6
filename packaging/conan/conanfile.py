# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Conan 2 recipe. From the root of the source tree:

    conan create packaging/conan                              # dependencies from Conan Center
    conan create packaging/conan -o "cullet/*:system=True"    # dependencies of the system, as Debian's
"""

import os

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class CulletConan(ConanFile):
    name = "cullet"
    version = "0.1.0"
    license = "Zlib"
    description = "Broad and narrow phase plug-in for Bullet"
    topics = ("physics", "collision-detection", "bullet", "cuda")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {
        "shared": [True, False],
        "cuda": [True, False],
        "system": [True, False],
        "double_precision": [True, False],
    }
    default_options = {"shared": False, "cuda": False, "system": False, "double_precision": False}

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "abi/*", "base/*", "broad/*", "cmake/*", "cuda/*", "mid/*", "narrow/*",
                        "packaging/debian/*", "packaging/man/*", "plugin/*", "recording/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        if not self.options.system:
            self.requires("bullet3/3.25", transitive_headers=True, transitive_libs=True)
            self.requires("eigen/3.4.0", transitive_headers=True)
            # For recordings, which are left out without it.
            self.requires("zlib/[>=1.2.11 <2]")

    def configure(self):
        if not self.options.system:
            self.options["bullet3"].double_precision = self.options.double_precision

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["CULLET_CUDA"] = "ON" if self.options.cuda else "OFF"
        toolchain.cache_variables["CULLET_PRECISIONS"] = self._scalar()
        # For programs that are linked with the system's Bullet.
        toolchain.cache_variables["CULLET_PRELOAD"] = False
        toolchain.cache_variables["CULLET_TESTS"] = False
        toolchain.cache_variables["CULLET_DEMOS"] = False
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        # cullet's own CMake package has the targets; it lies where find_package() looks.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "cullet")]
        self.cpp_info.includedirs = ["include"]
        self.cpp_info.libs = ["cullet-float64" if self.options.double_precision else "cullet"]

    def _scalar(self):
        return "double" if self.options.double_precision else "float"
