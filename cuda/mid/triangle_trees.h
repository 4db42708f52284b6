// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
#include "cullet/cuda/mid/triangle_types.h"

#include <cstdint>
#include <memory>
#include <string>

struct CUstream_st;

namespace cullet
{
/// Finds the pairs of triangles whose boxes overlap, of meshes that are in device memory and deform, and leaves them there:
/// of two meshes, or of one with itself. Boxes are exact and closed, so that triangles that touch are found.
///
/// Each mesh has a tree (Karras 2012), which is built anew or refitted when vertices have moved. The pairs are the same
/// either way, and in the same order: those of the CPU (triangles::TriangleSearches<psap::HostExec>). A refitted tree costs
/// less than a new one, and finds more slowly the farther triangles have moved relative to each other since it was built.
///
/// build(), refit() and the enqueue functions only put work on the stream, and wait only where memory has to grow and for a
/// search that is not collected. collect() waits for the work. No list has a capacity.
///
/// A tree reads the vertices of a mesh when the work of build() or refit() runs, and the indices in enqueueOwnPairs(), too:
/// they must stay until the pairs are collected.
///
/// After a failure all trees are empty; the next refit() of each is a build().
///
/// Uses 116 bytes of device memory for each triangle of every mesh, 12 for each of the largest mesh, and 32 for each pair of
/// the longest list; where these grow, up to half as much again.
class CULLET_API DeviceTriangleTrees
{
public:
    virtual ~DeviceTriangleTrees() = default;

    /// Number of trees, each empty at first. A function that gets the number of another tree does nothing with it: such
    /// a tree is empty.
    virtual std::uint32_t trees() const = 0;

    /// Replaces a tree.
    ///
    /// @return Ok, or the reason of a failure; OutOfMemory for 2^31 triangles or more
    virtual Status build(std::uint32_t tree, const DeviceTriangles& mesh) = 0;

    /// Replaces the boxes of a tree and keeps its nodes. Where the mesh has another number of triangles than the tree, this
    /// is build().
    ///
    /// @return as build()
    virtual Status refit(std::uint32_t tree, const DeviceTriangles& mesh) = 0;

    /// Searches the pairs (a triangle of mesh a, one of mesh b), of the trees as they are now. Replaces the last search.
    ///
    /// @param b another tree than a; the same one gives each pair in both orders, and pairs of a triangle with itself
    /// @return Ok, or the reason of a failure
    virtual Status enqueuePairs(std::uint32_t a, std::uint32_t b) = 0;

    /// Searches the pairs of different triangles of one mesh, the lower number first.
    virtual Status enqueueOwnPairs(std::uint32_t tree, OwnPairs which) = 0;

    /// Waits for the last search, repeats it where the list was too short, and sorts its pairs.
    ///
    /// @param pairs [out] valid until the next search or failure; none after a failure
    virtual Status collect(DeviceTrianglePairs& pairs) = 0;

    /// Bytes of device memory in use.
    virtual std::uint64_t bytes() const = 0;
};

/// @param trees  how many, at most 65,536
/// @param device CUDA device ordinal
/// @param stream the caller's cudaStream_t on that device; null: a stream of its own, which collect() waits for. That one
///     waits for no other stream: what writes vertices and indices must have ended before build() and refit()
/// @return null, with the reason in words in `*why`, which may be null: no device, driver too old, out of memory, built
///     without CUDA, too many trees
CULLET_API std::unique_ptr<DeviceTriangleTrees> makeDeviceTriangleTrees(std::uint32_t trees, int device,
                                                                        CUstream_st* stream,
                                                                        std::string* why);
}  // namespace cullet
