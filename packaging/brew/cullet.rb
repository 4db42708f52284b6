# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# A formula for Homebrew on Linux; ../README.md says how it was checked. Not for macOS: the shared library's link options
# are those of GNU's and LLVM's linkers for ELF.
class Cullet < Formula
  desc "Broad and narrow phase plug-in for Bullet"
  license "Zlib"
  # A tap puts url and sha256 of a release here; without them the formula builds this checkout's branch main.
  head File.expand_path("../..", __dir__), using: :git, branch: "main"

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "bullet"
  depends_on "eigen"
  depends_on :linux
  depends_on "zlib"

  def install
    # Homebrew has Bullet in one precision, which its CMake package defines.
    is_double = Dir[Formula["bullet"].opt_lib/"cmake/bullet/*"].any? do |file|
      File.read(file).include?("BT_USE_DOUBLE_PRECISION")
    end
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DCULLET_PRECISIONS=#{is_double ? "double" : "float"}",
           "-DCULLET_CUDA=OFF", "-DCULLET_TESTS=OFF", "-DCULLET_DEMOS=OFF", "-DCULLET_PRELOAD=OFF", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build", "--component", "runtime"
    system "cmake", "--install", "build", "--component", "development"
  end

  test do
    (testpath/"CMakeLists.txt").write <<~CMAKE
      cmake_minimum_required(VERSION 3.22)
      project(uses_cullet CXX)
      find_package(cullet REQUIRED)
    CMAKE
    system "cmake", "-S", ".", "-B", "build"
  end
end
