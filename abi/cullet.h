/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/**
 * @file cullet.h
 * cullet for C, and for every language that calls C. Plain C99; installed as <cullet/cullet.h>.
 *
 * Two libraries have this interface: libcullet for Bullet in single precision, libcullet-float64 for Bullet in double
 * precision. They may be linked or opened with dlopen(), also both in one process when opened with RTLD_LOCAL. They
 * stay loaded even after dlclose(), since Bullet may hold pointers to their functions.
 *
 * **Status.** A function that can fail returns a cullet_status: 0 for success; negative for an error, with nothing done
 * and nothing written to out-parameters; positive for success with a remark. cullet_last_error() returns a description
 * of the error. No C++ exception leaves a function, and none of Bullet's headers is needed.
 *
 * **Structs with a size.** A struct whose first member is `size` must be filled with zeros and then given
 * `size = sizeof(that struct)`; a member that stays zero has its default. Later versions append members: a library
 * reads and writes only the members that both it and the program have.
 *
 * **Handles** are pointers to incomplete types, created by a `_create` function and destroyed by its `_destroy`, which
 * ignores NULL. Any other NULL, unless it is documented as allowed, is CULLET_ERROR_NULL.
 *
 * **Threads.** Each function documents which calls may run concurrently. "Per handle" means: one call at a time on the
 * same handle, from any thread; different handles are independent.
 */

#ifndef CULLET_H
#define CULLET_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define CULLET_C_LINKAGE extern "C"
#else
#define CULLET_C_LINKAGE extern
#endif
#if defined(_WIN32) && defined(CULLET_BUILDS_LIBRARY)
#define CULLET_C_API CULLET_C_LINKAGE __declspec(dllexport)
#elif defined(__GNUC__) && !defined(_WIN32)
#define CULLET_C_API CULLET_C_LINKAGE __attribute__((visibility("default")))
#else
#define CULLET_C_API CULLET_C_LINKAGE
#endif

/** Incremented when functions or members are added. A program runs with every library whose cullet_abi_version() is not
 *  lower than this; a change that breaks programs gives the library another file name (its SOVERSION). */
#define CULLET_ABI_VERSION 5

typedef int32_t cullet_status;

enum
{
    CULLET_OK = 0,
    CULLET_EMPTY_BOXES = 1,           /**< done; some boxes have min > max or a NaN, and overlap nothing */
    CULLET_SOME_NOT_CONVERGED = 2,    /**< done; some pairs of a batch have the state CULLET_NOT_CONVERGED */
    CULLET_ERROR_NULL = -1,           /**< a pointer must not be NULL */
    CULLET_ERROR_ARGUMENT = -2,       /**< a value is out of its range */
    CULLET_ERROR_SIZE = -3,           /**< a size or a stride does not fit */
    CULLET_ERROR_ID = -4,             /**< an id is not in the set, or is given twice */
    CULLET_ERROR_NOT_FINITE = -5,     /**< a coordinate is NaN or infinite, or beyond 1e60 in a hull */
    CULLET_ERROR_PRECISION = -6,      /**< this library is for the other precision of Bullet */
    CULLET_ERROR_NO_DEVICE = -7,      /**< no usable GPU, or built without CUDA */
    CULLET_ERROR_DEVICE = -8,         /**< the GPU failed during the work */
    CULLET_ERROR_MEMORY = -9,         /**< out of memory, of the machine or the GPU */
    CULLET_ERROR_NOT_CONVERGED = -10, /**< shapes degenerate beyond double precision */
    CULLET_ERROR_INTERNAL = -11       /**< a bug in cullet; please report the text */
};

/** Version of the library's interface. Any thread. */
CULLET_C_API uint32_t cullet_abi_version(void);

/** Version of cullet, such as "0.1.0". Any thread. */
CULLET_C_API const char* cullet_version(void);

/** Precision of the library's Bullet: 32 or 64. Any thread. */
CULLET_C_API int32_t cullet_precision(void);

/** Name of a status, such as "CULLET_ERROR_NULL"; "unknown" for other numbers. Any thread. */
CULLET_C_API const char* cullet_status_name(cullet_status status);

/** Description of the error in the last failed call of this thread; "" before the first. Valid until the next failed
 *  call of the same thread; successful calls do not change it. Any thread. */
CULLET_C_API const char* cullet_last_error(void);

enum
{
    CULLET_LOG_INFO = 0,
    CULLET_LOG_WARNING = 1,
    CULLET_LOG_ERROR = 2
};

/** Receives one line of text; may be called from any thread, and must not call cullet. */
typedef void (*cullet_log_function)(int32_t level, const char* message);

/** Sets the receiver of messages; NULL: warnings and errors go to stderr, the default. Updates do not log unless a
 *  backend fails. Any thread. */
CULLET_C_API void cullet_set_log_function(cullet_log_function function);

/** The backend that finds the pairs. Every backend finds the same pairs. */
enum
{
    CULLET_BACKEND_AUTO = 0,  /**< the grid; for large Bullet worlds CUDA, if a device is available */
    CULLET_BACKEND_GRID = 1,  /**< hierarchical grid on the CPU */
    CULLET_BACKEND_BRUTE = 2, /**< every box against every other */
    CULLET_BACKEND_CUDA = 3   /**< a GPU */
};

/* ------------------------------------------------------- broad phase, contacts and solver of a Bullet world ------ */

/** A broad phase for Bullet. */
typedef struct cullet_broadphase cullet_broadphase;

typedef struct cullet_broadphase_options
{
    uint32_t size;          /**< sizeof(cullet_broadphase_options) */
    int32_t backend;        /**< CULLET_BACKEND_AUTO, ... */
    int32_t threads;        /**< of the CPU backends; 0: as many as the machine has */
    uint32_t device_bodies; /**< CULLET_BACKEND_AUTO: bodies from which on CUDA is used; 0: 2048 */
    double margin; /**< pairs leave when boxes are 2 * margin apart; 0: Bullet's, 0.05; negative: none */
} cullet_broadphase_options;

typedef struct cullet_broadphase_stats
{
    uint32_t size;          /**< sizeof(cullet_broadphase_stats) */
    uint32_t bodies;        /**< live proxies */
    uint32_t ghosts;        /**< the part of `bodies` that are ghosts */
    uint32_t reserved;      /**< 0 */
    uint64_t pairs;         /**< in the pair cache */
    uint64_t invalid_boxes; /**< boxes set with a NaN or min > max, since creation */
    uint64_t updates;       /**< calls of calculateOverlappingPairs */
    uint64_t fallbacks;     /**< backends that failed and were replaced by the grid */
    uint64_t bytes;         /**< memory of proxies, tables and lists */
    const char* backend;    /**< name, valid as long as the library is loaded */
} cullet_broadphase_stats;

/**
 * Creates a broad phase.
 *
 * @param scalar_bytes  sizeof(btScalar) of the program: 4 or 8
 * @param options       NULL: defaults
 * @param broadphase    [out]
 * Errors: CULLET_ERROR_PRECISION if scalar_bytes is that of the other precision; NULL, ARGUMENT, SIZE, MEMORY. Without
 * a device CULLET_BACKEND_CUDA uses the grid and logs a warning. Any thread.
 */
CULLET_C_API cullet_status cullet_broadphase_create(uint32_t scalar_bytes,
                                                    const cullet_broadphase_options* options,
                                                    cullet_broadphase** broadphase);

/**
 * The broad phase as a `btBroadphaseInterface*` of Bullet 3.24, for a world or for use on its own; NULL for NULL.
 * It belongs to the handle: do not delete it. The program must use the same shared Bullet as the library.
 *
 * Threads of the interface: queries may run concurrently; all other calls need exclusive access. Per handle.
 */
CULLET_C_API void* cullet_broadphase_interface(cullet_broadphase* broadphase);

/** Errors: NULL, SIZE. Per handle. */
CULLET_C_API cullet_status cullet_broadphase_get_stats(cullet_broadphase* broadphase,
                                                       cullet_broadphase_stats* stats);

/** Call after the world that uses it was destroyed; NULL is ignored. Per handle. */
CULLET_C_API void cullet_broadphase_destroy(cullet_broadphase* broadphase);

/** Counters of ISA-GJK on one dispatcher. They are never destroyed. */
typedef struct cullet_isa_gjk cullet_isa_gjk;

typedef struct cullet_isa_gjk_options
{
    uint32_t size; /**< sizeof(cullet_isa_gjk_options) */
    /** Box against box. 0: separating axes and patches; 1: ISA-GJK; 2: Bullet's own algorithm */
    int32_t box_box;
    /** 1: points of hull shapes never change and shapes are never deleted; 0: compare the points in queries */
    int32_t constant_points;
    /** Convex shapes against meshes, height fields and other concave shapes. 0: cullet chooses the triangles, and the
     *  points that carry the contact; 1: Bullet's loop over triangles */
    int32_t stock_meshes;
    /** 1: correct the normals at edges inside of a mesh, so that sliding bodies do not jump there, with stock_meshes 0;
     *  0: as Bullet */
    int32_t active_edges;
    /** Contact points of a pair and step at most, 1 to 4; 0: 4. With 1 or 2, bodies do not rest on their faces. */
    int32_t patch_points;
    /** Length that a pair may move until its contacts are computed again; 0: they are computed in every step */
    double reuse_distance;
    /** Angle in radians that it may turn until then, up to 1; 0: 0.035 */
    double reuse_angle;
    /** Compound shapes. 0: cullet finds the children that may touch; 1: Bullet's loops over children */
    int32_t stock_compounds;
    int32_t reserved; /**< 0 */
} cullet_isa_gjk_options;

typedef struct cullet_isa_gjk_stats
{
    uint32_t size;          /**< sizeof(cullet_isa_gjk_stats) */
    uint32_t reserved;      /**< 0 */
    uint64_t separated;     /**< queries in which an axis proved that there is no contact */
    uint64_t touching;      /**< queries that made contacts */
    uint64_t depths;        /**< the part of `touching` with overlapping cores */
    uint64_t not_converged; /**< queries without an answer, left to Bullet */
    uint64_t delegated;     /**< queries that are left to Bullet by design */
} cullet_isa_gjk_stats;

/**
 * Lets ISA-GJK make the contacts of convex pairs. Call once per dispatcher, before bodies are added.
 *
 * @param scalar_bytes  sizeof(btScalar) of the program
 * @param dispatcher    `btCollisionDispatcher*`
 * @param options       NULL: defaults
 * @param isa_gjk       [out] for cullet_isa_gjk_get_stats(); may be NULL
 * Errors: PRECISION, NULL, ARGUMENT, SIZE, MEMORY. One call at a time per dispatcher, not during a step.
 */
CULLET_C_API cullet_status cullet_isa_gjk_register(uint32_t scalar_bytes, void* dispatcher,
                                                   const cullet_isa_gjk_options* options,
                                                   cullet_isa_gjk** isa_gjk);

/** Errors: NULL, SIZE. Any thread. */
CULLET_C_API cullet_status cullet_isa_gjk_get_stats(const cullet_isa_gjk* isa_gjk,
                                                    cullet_isa_gjk_stats* stats);

/** A solver for Bullet's worlds, in place of btSequentialImpulseConstraintSolver. */
typedef struct cullet_solver cullet_solver;

enum
{
    CULLET_SOLVER_BULLET = 0, /**< contacts behave as with Bullet's solver and the same parameters */
    CULLET_SOLVER_SOFT = 1    /**< springs and dampers, solved in substeps: bodies come to rest */
};

typedef struct cullet_solver_options
{
    uint32_t size;    /**< sizeof(cullet_solver_options) */
    int32_t model;    /**< CULLET_SOLVER_BULLET, ... */
    int32_t threads;  /**< at most; 0: as many as the machine has. Results do not depend on it */
    int32_t substeps; /**< CULLET_SOLVER_SOFT, as all below: 1 to 64; 0: 4 */
    /** Of a contact between two bodies that move, in 1 / s; twice that with one that does not. 0: 30 */
    double contact_frequency;
    double contact_damping; /**< as a multiple of critical damping; 0: 10 */
    double push_speed;      /**< the most by which overlap separates bodies, in m / s; 0: 3 */
} cullet_solver_options;

/** Why Bullet's solver solved a group: a part of a step whose bodies touch no others. */
enum
{
    CULLET_REFUSAL_NONE = 0,          /**< it did not */
    CULLET_REFUSAL_RANDOM_ORDER = 1,  /**< SOLVER_RANDMIZE_ORDER */
    CULLET_REFUSAL_FOREIGN_ROWS = 2,  /**< row functions of the application */
    CULLET_REFUSAL_FOREIGN_JOINT = 3, /**< a joint of a class of the application, or one that solves itself */
    CULLET_REFUSAL_NO_MEMORY = 4      /**< no memory for the rows */
};

/** Of the last group that the world gave to the solver. */
typedef struct cullet_solver_stats
{
    uint32_t size;               /**< sizeof(cullet_solver_stats) */
    int32_t refusal;             /**< CULLET_REFUSAL_NONE, ... */
    uint32_t groups;             /**< solved, also by Bullet's solver */
    uint32_t refused_groups;     /**< those that Bullet's solver solved */
    uint32_t contacts;           /**< manifolds with points, of the groups that were not refused */
    uint32_t joints;             /**< enabled joints with rows */
    uint32_t serial_constraints; /**< of a body with more than 64 contacts and joints, beyond the first 64 */
    uint32_t reserved;           /**< 0 */
} cullet_solver_stats;

/**
 * Creates a solver.
 *
 * @param scalar_bytes  sizeof(btScalar) of the program
 * @param options       NULL: defaults
 * @param solver        [out]
 * Errors: PRECISION, NULL, SIZE, MEMORY; ARGUMENT for a model or a number out of range, a NaN, or a double that is no
 * finite btScalar above 0. Any thread.
 */
CULLET_C_API cullet_status cullet_solver_create(uint32_t scalar_bytes, const cullet_solver_options* options,
                                                cullet_solver** solver);

/**
 * The solver as a `btConstraintSolver*` of Bullet 3.24, for the constructor of a world or setConstraintSolver(); NULL for
 * NULL. It points to a class derived from btSequentialImpulseConstraintSolver and belongs to the handle: do not delete
 * it. The program must use the same shared Bullet as the library. What differs from Bullet's solver is in cullet's
 * guide to the solver.
 *
 * Threads of the interface: one step of one world at a time. Per handle.
 */
CULLET_C_API void* cullet_solver_interface(cullet_solver* solver);

/** Errors: NULL, SIZE. Per handle, not during a step. */
CULLET_C_API cullet_status cullet_solver_get_stats(cullet_solver* solver, cullet_solver_stats* stats);

/** Call after the world that uses it was destroyed; NULL is ignored. Per handle. */
CULLET_C_API void cullet_solver_destroy(cullet_solver* solver);

/* ---------------------------------------------------------------- boxes without Bullet ---------------------------- */

/** A set of boxes with ids, and the overlapping pairs of them. */
typedef struct cullet_box_set cullet_box_set;

typedef struct cullet_box_set_options
{
    uint32_t size;   /**< sizeof(cullet_box_set_options) */
    int32_t backend; /**< CULLET_BACKEND_AUTO is the grid */
    int32_t threads; /**< for updates; 0: as many as the machine has */
    float margin;    /**< finite, >= 0: a pair leaves when the boxes, each grown by it, no longer overlap */
} cullet_box_set_options;

/** Ids of two boxes, first < second. */
typedef struct cullet_pair
{
    uint32_t first;
    uint32_t second;
} cullet_pair;

/** An array that the library owns. */
typedef struct cullet_pairs
{
    const cullet_pair* data;
    uint64_t count;
} cullet_pairs;

/** Two boxes may pair when (a.group & b.mask) and (b.group & a.mask). */
typedef struct cullet_filter
{
    int32_t group;
    int32_t mask;
} cullet_filter;

typedef struct cullet_box_set_stats
{
    uint32_t size;       /**< sizeof(cullet_box_set_stats) */
    uint32_t boxes;      /**< in the set */
    uint64_t pairs;      /**< after the last update */
    uint64_t fallbacks;  /**< backends that failed and were replaced by the grid */
    uint64_t bytes;      /**< memory of set and backend */
    const char* backend; /**< name, valid as long as the library is loaded */
} cullet_box_set_stats;

/** @param options NULL: defaults
 *  Errors: NULL, ARGUMENT, SIZE, MEMORY; NO_DEVICE for CULLET_BACKEND_CUDA. Any thread. */
CULLET_C_API cullet_status cullet_box_set_create(const cullet_box_set_options* options, cullet_box_set** set);

/** NULL is ignored. Per handle. */
CULLET_C_API void cullet_box_set_destroy(cullet_box_set* set);

/**
 * Adds boxes.
 *
 * Ids start at 1, grow by 1 with every box, and are never reused. Boxes are closed: boxes that touch overlap.
 *
 * @param boxes   six floats each: min x, y, z, max x, y, z; any values, infinities included
 * @param stride  bytes from a box to the next, at least 24; 0: 24
 * @param count   0 is allowed, with NULL pointers
 * @param ids     [count, out]
 * @return CULLET_EMPTY_BOXES if some boxes overlap nothing
 * Errors: NULL, SIZE, ARGUMENT (more than 2^30 boxes, or no id left), MEMORY (`count` ids may be lost). Per handle.
 * Cost: O(count).
 */
CULLET_C_API cullet_status cullet_box_set_add(cullet_box_set* set, const float* boxes, size_t stride,
                                              uint32_t count, uint32_t* ids);

/** Moves boxes. If an id is given twice, its later box is used. @return CULLET_EMPTY_BOXES if some overlap nothing
 *  Errors: NULL, SIZE, ID. Per handle. Cost: O(count). */
CULLET_C_API cullet_status cullet_box_set_move(cullet_box_set* set, const uint32_t* ids, const float* boxes,
                                               size_t stride, uint32_t count);

/** Sets filters; initially every box has group 1 and mask -1. They are evaluated when a pair is about to enter; an
 *  existing pair stays until its boxes separate. Errors: NULL, ID. Per handle. Cost: O(count). */
CULLET_C_API cullet_status cullet_box_set_filter(cullet_box_set* set, const uint32_t* ids,
                                                 const cullet_filter* filters, uint32_t count);

/** Removes boxes; the next update removes their pairs. Errors: NULL, ID, MEMORY. Per handle.
 *  Cost: O(count log count). */
CULLET_C_API cullet_status cullet_box_set_remove(cullet_box_set* set, const uint32_t* ids, uint32_t count);

/**
 * Finds the pairs of the current boxes.
 *
 * @param added    [out] pairs added since the last update, sorted by (first, second); may be NULL
 * @param removed  [out] pairs removed since the last update, sorted; may be NULL
 * The arrays are valid until the next update or the destruction of the set.
 * Errors: NULL, MEMORY. After MEMORY the pairs are those of the previous update, and the next successful update
 * reports all changes since then. A backend that fails, because of a GPU or for lack of memory, is replaced by the
 * grid, with the same pairs and a logged warning. Per handle.
 */
CULLET_C_API cullet_status cullet_box_set_update(cullet_box_set* set, cullet_pairs* added,
                                                 cullet_pairs* removed);

/** All pairs of the last update, sorted; valid until the next update. Errors: NULL. Per handle. */
CULLET_C_API cullet_status cullet_box_set_pairs(const cullet_box_set* set, cullet_pairs* pairs);

/** Errors: NULL, SIZE. Per handle. */
CULLET_C_API cullet_status cullet_box_set_get_stats(const cullet_box_set* set, cullet_box_set_stats* stats);

/** Finds pairs of boxes in GPU memory, and writes the pairs to GPU memory. */
typedef struct cullet_device_finder cullet_device_finder;

typedef struct cullet_device_finder_options
{
    uint32_t size;  /**< sizeof(cullet_device_finder_options) */
    int32_t device; /**< CUDA device ordinal */
    void* stream;   /**< cudaStream_t of that device; NULL: an own stream */
} cullet_device_finder_options;

/** @param options NULL: defaults. Errors: NULL, ARGUMENT, SIZE, MEMORY; NO_DEVICE with a reason. Any thread. */
CULLET_C_API cullet_status cullet_device_finder_create(const cullet_device_finder_options* options,
                                                       cullet_device_finder** finder);

/** NULL is ignored. Per handle. */
CULLET_C_API void cullet_device_finder_destroy(cullet_device_finder* finder);

/**
 * Enqueues a search on the stream, without waiting for it.
 *
 * @param device_boxes  [6 * count] device memory, boxes without gaps; must not change before the collect. NULL if count
 *                      is 0. Memory that does not belong to the device is a fault that ends its CUDA context.
 * Errors: NULL, DEVICE, MEMORY, ARGUMENT (2^30 boxes or more). Per handle.
 */
CULLET_C_API cullet_status cullet_device_finder_enqueue(cullet_device_finder* finder,
                                                        const float* device_boxes, uint64_t count);

/** Waits for the search and returns its pairs.
 *
 *  @param device_pairs  [out] `data` is device memory, valid until the next enqueue: indices of boxes, starting at 0,
 *                       the lower or the higher one first, each pair once, unordered. Boxes with a NaN or min > max
 *                       have none.
 *  Errors: NULL, DEVICE, MEMORY, ARGUMENT (the last enqueue failed, or there was none). Per handle. */
CULLET_C_API cullet_status cullet_device_finder_collect(cullet_device_finder* finder,
                                                        cullet_pairs* device_pairs);

/** Finds pairs of triangles whose boxes overlap, of meshes in GPU memory that deform, and writes them to GPU memory. Each
 *  mesh has a tree, which is built anew or refitted when vertices have moved; the pairs are the same either way. */
typedef struct cullet_triangle_trees cullet_triangle_trees;

typedef struct cullet_triangle_trees_options
{
    uint32_t size;  /**< sizeof(cullet_triangle_trees_options) */
    int32_t device; /**< CUDA device ordinal */
    void* stream;   /**< cudaStream_t of that device; NULL: an own stream, which waits for no other one */
    uint32_t trees; /**< number of meshes, at most 65536; 0: 2 */
    uint32_t reserved;
} cullet_triangle_trees_options;

/** A mesh in device memory. Strides count elements, as those of DLPack: a tensor of floats of shape [vertex_count, 3] with
 *  strides (vertex_stride, 1), and one of 32-bit integers of shape [triangle_count, 3] with strides (index_stride, 1). */
typedef struct cullet_device_mesh
{
    uint32_t size; /**< sizeof(cullet_device_mesh) */
    uint32_t vertex_count;
    const float* vertices;  /**< length unit of the world */
    uint64_t vertex_stride; /**< 0: 3 */
    const uint32_t*
        indices; /**< vertices of each triangle; NULL: 0, 1, 2 of the first, 3, 4, 5 of the next, and so on */
    uint64_t index_stride;   /**< 0: 3 */
    uint32_t triangle_count; /**< below 2^31 */
    uint32_t reserved;
} cullet_device_mesh;

/** Which pairs of triangles of one mesh count. */
enum
{
    CULLET_OWN_PAIRS_ALL = 0,
    CULLET_OWN_PAIRS_WITHOUT_NEIGHBOURS = 1 /**< not those with a common vertex, by its index */
};

/** All trees are without triangles.
 *  @param options NULL: defaults. Errors: NULL, ARGUMENT, SIZE; NO_DEVICE with a reason. Any thread. */
CULLET_C_API cullet_status cullet_triangle_trees_create(const cullet_triangle_trees_options* options,
                                                        cullet_triangle_trees** trees);

/** NULL is ignored. Per handle. */
CULLET_C_API void cullet_triangle_trees_destroy(cullet_triangle_trees* trees);

/**
 * Enqueues the steps that replace a tree on the stream, without waiting for them, but for a search that is not collected.
 *
 * A triangle with an index that is not below vertex_count, or with a coordinate that is not finite, is in no pair. The
 * vertices are read when the steps run; the indices must stay until the pairs are collected, too. Memory that does not
 * belong to the device is a fault that ends its CUDA context.
 *
 * @param tree number of the tree, from 0 on
 * Errors: NULL, SIZE, ARGUMENT, DEVICE, MEMORY. After DEVICE and MEMORY all trees are without triangles. Per handle.
 */
CULLET_C_API cullet_status cullet_triangle_trees_build(cullet_triangle_trees* trees, uint32_t tree,
                                                       const cullet_device_mesh* mesh);

/** As cullet_triangle_trees_build(), but keeps the nodes of the tree, which costs less; searches take longer the farther
 *  triangles have moved relative to each other. Builds where the number of triangles is not that of the tree. Per handle. */
CULLET_C_API cullet_status cullet_triangle_trees_refit(cullet_triangle_trees* trees, uint32_t tree,
                                                       const cullet_device_mesh* mesh);

/** Enqueues a search for the pairs of a triangle of mesh a and one of mesh b. It replaces the last search.
 *  Errors: NULL, ARGUMENT (a number of a tree), DEVICE, MEMORY. Per handle. */
CULLET_C_API cullet_status cullet_triangle_trees_enqueue_pairs(cullet_triangle_trees* trees, uint32_t a,
                                                               uint32_t b);

/** Enqueues a search for the pairs of different triangles of one mesh, the lower index first. It replaces the last search.
 *  @param which CULLET_OWN_PAIRS_ALL, ... Errors: as cullet_triangle_trees_enqueue_pairs(). Per handle. */
CULLET_C_API cullet_status cullet_triangle_trees_enqueue_own_pairs(cullet_triangle_trees* trees,
                                                                   uint32_t tree, int32_t which);

/** Waits for the search and returns its pairs.
 *
 *  @param device_pairs [out] `data` is device memory, valid until the next search: indices of triangles, sorted by (first,
 *                      second), each pair once. Boxes are closed: triangles that touch are a pair
 *  @param invalid      [out] triangles of these meshes that can be in no pair; may be NULL
 *  Errors: NULL, DEVICE, MEMORY, ARGUMENT (the last call failed, or there was no search). Per handle. */
CULLET_C_API cullet_status cullet_triangle_trees_collect(cullet_triangle_trees* trees,
                                                         cullet_pairs* device_pairs, uint64_t* invalid);

/* ---------------------------------------------------------------- convex hulls ------------------------------------ */

/** Convex hull of points. It never changes: any number of threads may use it concurrently. */
typedef struct cullet_hull cullet_hull;

/** State of the queries of one pair of hulls, in this order, which makes the next query faster. It changes only the
 *  last digits of the results. */
typedef struct cullet_hull_cache cullet_hull_cache;

/** A point x of a hull is at basis * x + origin in the world. */
typedef struct cullet_pose
{
    double basis[9];  /**< row-major; a rotation, or any invertible matrix */
    double origin[3]; /**< length unit of the world */
} cullet_pose;

enum
{
    CULLET_SEPARATED = 0,    /**< the distance is larger than the requested maximum */
    CULLET_NEAR = 1,         /**< 0 < distance <= the requested maximum */
    CULLET_OVERLAPPING = 2,  /**< the hulls have a point in common */
    CULLET_NOT_CONVERGED = 3 /**< of a batch: no answer, the hulls are degenerate beyond double precision */
};

typedef struct cullet_hull_result
{
    uint32_t size;     /**< sizeof(cullet_hull_result) */
    int32_t state;     /**< CULLET_SEPARATED, ... */
    double distance;   /**< of the hulls; of overlapping ones 0, or minus the depth */
    double axis[3];    /**< unit vector from B to A; zero if the query computes none */
    double point_a[3]; /**< closest or deepest point of A, in the world; zero if the query computes none */
    double point_b[3]; /**< closest or deepest point of B; point_a - point_b = distance * axis */
} cullet_hull_result;

/**
 * Creates the convex hull of points: a solid, a polygon, a segment or a single point, depending on what they span.
 *
 * @param points  three doubles each
 * @param stride  bytes from a point to the next, at least 24; 0: 24
 * @param count   at least 1, at most 2^24
 * Errors: NULL, SIZE, ARGUMENT, NOT_FINITE, MEMORY. Any thread. Cost: about 1 ms for 1,000 points.
 */
CULLET_C_API cullet_status cullet_hull_create(const double* points, size_t stride, uint32_t count,
                                              cullet_hull** hull);

/** Vertices of the hull; 0 for NULL. Any thread. */
CULLET_C_API uint32_t cullet_hull_vertex_count(const cullet_hull* hull);

/** Call when no other call uses it; NULL is ignored. */
CULLET_C_API void cullet_hull_destroy(cullet_hull* hull);

/** Errors: NULL, MEMORY. Any thread. */
CULLET_C_API cullet_status cullet_hull_cache_create(cullet_hull_cache** cache);

/** NULL is ignored. Per handle. */
CULLET_C_API void cullet_hull_cache_destroy(cullet_hull_cache* cache);

/**
 * Tests whether two hulls have a point in common, by ISA-GJK (van den Bergen 1999).
 *
 * @param pose_a, pose_b  NULL: identity
 * @param cache           NULL: none
 * @param overlaps        [out] 1 or 0
 * @param axis            [3, out] a separating axis from B to A, of any length, or zeros if they overlap; may be NULL
 * Errors: NULL, NOT_FINITE, ARGUMENT (a basis that cannot be inverted), NOT_CONVERGED. Any thread, one call at a time
 * per cache.
 */
CULLET_C_API cullet_status cullet_hull_overlap(const cullet_hull* a, const cullet_pose* pose_a,
                                               const cullet_hull* b, const cullet_pose* pose_b,
                                               cullet_hull_cache* cache, int32_t* overlaps, double* axis);

/**
 * Computes the distance of two hulls and their closest points, by GJK.
 *
 * @param max_distance  hulls farther apart than this are reported as CULLET_SEPARATED as soon as that is certain,
 *                      with an axis but without distance and points; INFINITY computes every distance
 * Overlapping hulls have distance 0, no axis and no points; see cullet_hull_penetration().
 * Errors and threads: as cullet_hull_overlap(), and ARGUMENT for a negative max_distance or a NaN; SIZE.
 */
CULLET_C_API cullet_status cullet_hull_distance(const cullet_hull* a, const cullet_pose* pose_a,
                                                const cullet_hull* b, const cullet_pose* pose_b,
                                                double max_distance, cullet_hull_cache* cache,
                                                cullet_hull_result* result);

/**
 * Computes the penetration depth of two hulls by the expanding polytope algorithm: A moved by -distance * axis only
 * touches B.
 *
 * Hulls that do not overlap are reported as CULLET_SEPARATED, with distance, axis and points zero.
 * Errors and threads: as cullet_hull_distance(). Cost: about ten times that of a distance.
 */
CULLET_C_API cullet_status cullet_hull_penetration(const cullet_hull* a, const cullet_pose* pose_a,
                                                   const cullet_hull* b, const cullet_pose* pose_b,
                                                   cullet_hull_cache* cache, cullet_hull_result* result);

/** What a batch computes for each of its pairs. */
enum
{
    CULLET_QUERY_OVERLAP = 0,     /**< as cullet_hull_overlap(): state, and an axis of any length */
    CULLET_QUERY_DISTANCE = 1,    /**< as cullet_hull_distance() */
    CULLET_QUERY_PENETRATION = 2, /**< as cullet_hull_penetration() */
    CULLET_QUERY_CONTACT = 3      /**< the distance, or the depth of hulls that overlap */
};

/** Hulls in the world: body i is hulls[i] at poses[i]. */
typedef struct cullet_bodies
{
    const cullet_hull* const* hulls; /**< [count]; a hull may stand there any number of times */
    const cullet_pose* poses;        /**< [count]; NULL: identity for all */
    uint32_t count;
    uint32_t reserved; /**< 0 */
} cullet_bodies;

/** Pairs of bodies. Without `pairs`, pair i is body i of a and body i of b, where a single body stands for all. */
typedef struct cullet_hull_batch
{
    uint32_t size;            /**< sizeof(cullet_hull_batch) */
    int32_t query;            /**< CULLET_QUERY_OVERLAP, ... */
    cullet_bodies a;          /**< may be the same bodies as b */
    cullet_bodies b;          /**< axes point from b to a */
    const cullet_pair* pairs; /**< [pair_count] first: index of a, second: index of b; may be NULL */
    uint64_t pair_count;      /**< below 2^32 */
    double max_distance;      /**< of CULLET_QUERY_DISTANCE and _CONTACT, as in cullet_hull_distance() */
    int32_t threads;          /**< at most; 0: as many as the machine has. Results do not depend on it */
    int32_t reserved;         /**< 0 */
} cullet_hull_batch;

/** Arrays of the caller that a batch fills, with the members of cullet_hull_result; NULL: not wanted. */
typedef struct cullet_hull_results
{
    uint32_t size;     /**< sizeof(cullet_hull_results) */
    uint32_t reserved; /**< 0 */
    int32_t* states;   /**< [pair_count] CULLET_SEPARATED, ... */
    double* distances; /**< [pair_count] */
    double* axes;      /**< [3 * pair_count] */
    double* points_a;  /**< [3 * pair_count] */
    double* points_b;  /**< [3 * pair_count] */
} cullet_hull_results;

/**
 * Computes many pairs of hulls, on several threads if there are enough of them.
 *
 * The results are those of the functions for one pair without a cache, and do not depend on other pairs.
 *
 * @return CULLET_SOME_NOT_CONVERGED if some pairs have no answer; their other members are zero
 * Errors: NULL, SIZE, MEMORY; NOT_FINITE and ARGUMENT for poses, as in cullet_hull_overlap(), also of bodies without
 * pairs; ARGUMENT for a query, an index, a max_distance or threads out of range. After MEMORY some elements of the
 * results are written. Any thread. Cost: a check of each body and pair, then that of each query.
 */
CULLET_C_API cullet_status cullet_hull_query_batch(const cullet_hull_batch* batch,
                                                   const cullet_hull_results* results);

/* ---------------------------------------------------------------- convex hulls in GPU memory ---------------------- */

/** Finds bodies near each other, of poses in GPU memory, and which of them overlap: boxes, pairs and answers on one stream.
 *  Arrays are given and returned as they are, without gaps; their shapes, element types and strides, in elements, are those of
 *  DLPack. */
typedef struct cullet_contact_finder cullet_contact_finder;

typedef struct cullet_contact_finder_options
{
    uint32_t size;  /**< sizeof(cullet_contact_finder_options) */
    int32_t device; /**< CUDA device ordinal */
    void* stream;   /**< cudaStream_t of that device; NULL: an own stream, which waits for no other one */
} cullet_contact_finder_options;

/** Where a body is: 32 bytes. An array of them is a tensor of 32-bit floats of shape [count, 8] with strides (8, 1), whose
 *  column 3 has the bits of an integer. */
typedef struct cullet_device_pose
{
    float position[3]; /**< length unit of the world */
    uint32_t hull;     /**< its place in the list of hulls, from 0 on */
    float
        rotation[4]; /**< quaternion x, y, z, w of a length between 1/2 and 2; it is divided by its length */
} cullet_device_pose;

/** What is found of pairs that overlap; each includes those before it. */
enum
{
    CULLET_TOUCHING_NONE = 0,
    CULLET_TOUCHING_LIST = 1,    /**< cullet_contacts::overlaps */
    CULLET_TOUCHING_DEPTHS = 2,  /**< cullet_contacts::depths */
    CULLET_TOUCHING_CONTACTS = 3 /**< cullet_contacts::contacts */
};

typedef struct cullet_contact_query
{
    uint32_t size;        /**< sizeof(cullet_contact_query) */
    int32_t touching;     /**< CULLET_TOUCHING_NONE, ... */
    float margin;         /**< every box is grown by it; finite, 0 or more */
    float max_distance;   /**< above 0, also infinite: cullet_contacts::distances of pairs no farther apart */
    float contact_margin; /**< of CULLET_TOUCHING_CONTACTS: points no farther apart; 0 or more */
    uint32_t reserved;    /**< 0 */
} cullet_contact_query;

/** State of a pair, a byte. */
enum
{
    CULLET_PAIR_APART = 0,       /**< its axis separates the hulls */
    CULLET_PAIR_OVERLAPPING = 1, /**< the hulls have a point in common, or touch up to rounding */
    CULLET_PAIR_UNDECIDED = 2,   /**< hulls flatter than the rounding of double: treat as overlapping */
    CULLET_PAIR_INVALID = 3      /**< beyond the last pair */
};

/** The pairs and their answers; all pointers are to device memory. */
typedef struct cullet_contacts
{
    uint32_t size;        /**< sizeof(cullet_contacts) */
    uint32_t overlapping; /**< number of pairs of that state */
    uint64_t count;       /**< number of pairs */
    uint64_t added;       /**< pairs that were none after the last enqueue */
    uint64_t removed;     /**< pairs of the last enqueue that are none */
    /** Indices of poses, the lower one first, in ascending order: 32-bit integers of shape [count, 2], strides (2, 1) */
    const cullet_pair* pairs;
    const uint8_t* states; /**< [count] CULLET_PAIR_APART, ... */
    /** Floats of shape [count, 4], strides (4, 1): where a pair is apart, a unit vector along which all of the first body
     *  is farther than all of the second; column 3 is for the library */
    const float* axes;
    /** Floats of shape [count, 8], strides (8, 1): the closest point of the first body, the distance, the closest point of
     *  the second body, and 0. Points are relative to the position of the first. The distance is infinite where it exceeds
     *  max_distance, and 0 where the state is not CULLET_PAIR_APART; the points are then 0. NULL if not asked for */
    const float* distances;
    /** [overlapping] places of overlapping pairs, ascending. NULL if not asked for */
    const uint32_t* overlaps;
    /** Floats of shape [overlapping, 8], strides (8, 1), of the pairs in `overlaps`: a unit vector from the second body to
     *  the first, the depth, the deepest point of the second body relative to the position of the first, and up to what
     *  the depth is proved. The first body, moved by depth * vector, only touches. NULL if not asked for */
    const float* depths;
    /** Floats of shape [overlapping, 20], strides (20, 1), of the pairs in `overlaps`: the vector as above; the number of
     *  points, 1 to 4, as the bits of an integer; for each of four points that of the second body, relative to the position
     *  of the first, and its depth, negative for a gap. The first is the deepest, up to a thousandth of the sum of its depth
     *  and the margin. NULL if not asked for */
    const float* contacts;
    /** Numbers of pairs and of overlaps. The first is 2^64 - 1 where a list was too short, see
     *  cullet_contact_finder_ahead(). The second is NULL if overlaps is */
    const uint64_t* device_count;
    const uint32_t* device_overlapping;
} cullet_contacts;

/**
 * Copies hulls to a device.
 *
 * @param hulls    [count] may be destroyed afterwards; their vertices are rounded to float. NULL if count is 0
 * @param options  NULL: defaults
 * Errors: NULL, SIZE, ARGUMENT, MEMORY; NOT_FINITE for a vertex beyond the range of float; NO_DEVICE with a reason. Any
 * thread.
 */
CULLET_C_API cullet_status cullet_contact_finder_create(const cullet_hull* const* hulls, uint32_t count,
                                                        const cullet_contact_finder_options* options,
                                                        cullet_contact_finder** finder);

/** NULL is ignored. Per handle. */
CULLET_C_API void cullet_contact_finder_destroy(cullet_contact_finder* finder);

/**
 * Enqueues the search on the stream, after that of the last enqueue, which it waits for.
 *
 * Pairs are those whose boxes overlap. A body with a hull that is none, or with a pose that is not finite or has a quaternion
 * of another length, has no pairs. What is known of a pair makes its next answer faster, as long as it is a pair. The same
 * calls give the same bits in every run.
 *
 * @param device_poses  [count] device memory, aligned to 16 bytes; element i is the same body in every call. Must not change
 *                      before the collect. NULL if count is 0. Memory that does not belong to the device is a fault that
 *                      ends its CUDA context
 * @param count         below 2^31
 * @param query         NULL: defaults
 * Errors: NULL, SIZE, ARGUMENT, DEVICE, MEMORY. After DEVICE and MEMORY nothing is known of any pair. Per handle.
 */
CULLET_C_API cullet_status cullet_contact_finder_enqueue(cullet_contact_finder* finder,
                                                         const cullet_device_pose* device_poses,
                                                         uint32_t count, const cullet_contact_query* query);

/** The arrays that the search will write, for work that is put on the same stream, without waiting.
 *
 *  @param contacts [out] `count` is the room of the arrays, beyond *device_count with the state CULLET_PAIR_INVALID. Where
 *                  *device_count is 2^64 - 1, the arrays are void, and only the collect has the answers. `overlapping` is the
 *                  room of depths and contacts; where *device_overlapping is above it, the others come with the collect
 *  Errors: NULL, SIZE, ARGUMENT (the last enqueue failed or was collected, or there was none). Per handle. */
CULLET_C_API cullet_status cullet_contact_finder_ahead(cullet_contact_finder* finder,
                                                       cullet_contacts* contacts);

/** Waits for the search, repeats it where a list was too short, and returns its answers.
 *
 *  @param contacts [out] arrays are valid until the next enqueue
 *  Errors: NULL, SIZE, DEVICE, MEMORY, ARGUMENT (the last enqueue failed, or there was none). Per handle. */
CULLET_C_API cullet_status cullet_contact_finder_collect(cullet_contact_finder* finder,
                                                         cullet_contacts* contacts);

/** Forgets all pairs: those of the next enqueue are all new. Waits for the stream. Errors: NULL. Per handle. */
CULLET_C_API cullet_status cullet_contact_finder_forget(cullet_contact_finder* finder);

#endif
