/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Both libraries opened in one process that links neither, nor Bullet. Arguments: their paths, single precision first. */
#define _POSIX_C_SOURCE 200809L

#include "check.h"
#include <cullet/cullet.h>
#include <dlfcn.h>
#include <pthread.h>
#include <string.h>

/* ISO C has no cast between pointers to data and to functions; POSIX promises that they have the same bytes. */
#define LOAD(library, name)                              \
    do                                                   \
    {                                                    \
        void* symbol = dlsym(library, "cullet_" #name);  \
        CHECK(symbol != NULL);                           \
        memcpy(&(loaded.name), &symbol, sizeof(symbol)); \
    } while (0)

static struct
{
    uint32_t (*abi_version)(void);
    int32_t (*precision)(void);
    const char* (*last_error)(void);
    cullet_status (*box_set_create)(const cullet_box_set_options*, cullet_box_set**);
    cullet_status (*box_set_add)(cullet_box_set*, const float*, size_t, uint32_t, uint32_t*);
    cullet_status (*box_set_update)(cullet_box_set*, cullet_pairs*, cullet_pairs*);
    void (*box_set_destroy)(cullet_box_set*);
    cullet_status (*broadphase_create)(uint32_t, const cullet_broadphase_options*, cullet_broadphase**);
    void* (*broadphase_interface)(cullet_broadphase*);
    void (*broadphase_destroy)(cullet_broadphase*);
    void (*set_log_function)(cullet_log_function);
} loaded;

static void load(void* library)
{
    LOAD(library, abi_version);
    LOAD(library, precision);
    LOAD(library, last_error);
    LOAD(library, box_set_create);
    LOAD(library, box_set_add);
    LOAD(library, box_set_update);
    LOAD(library, box_set_destroy);
    LOAD(library, broadphase_create);
    LOAD(library, broadphase_interface);
    LOAD(library, broadphase_destroy);
    LOAD(library, set_log_function);
}

static void testBoxes(void)
{
    const float boxes[18] = {0, 0, 0, 2, 2, 2, 1, 1, 1, 3, 3, 3, 2.5f, 0, 0, 4, 4, 4};
    cullet_box_set* set = NULL;
    cullet_pairs added;
    uint32_t ids[3];
    CHECK(loaded.box_set_create(NULL, &set) == CULLET_OK);
    CHECK(loaded.box_set_add(set, boxes, 0, 3, ids) == CULLET_OK);
    CHECK(loaded.box_set_update(set, &added, NULL) == CULLET_OK);
    CHECK(added.count == 2 && added.data[0].second == 2 && added.data[1].first == 2);
    loaded.box_set_destroy(set);
}

static int messageCount = 0;

static void countMessage(int32_t level, const char* message)
{
    CHECK(level == CULLET_LOG_WARNING && strstr(message, "CUDA") != NULL);
    ++messageCount;
}

static void testBroadphase(uint32_t scalarBytes)
{
    cullet_broadphase* broadphase = NULL;
    const cullet_broadphase_options options = {sizeof(options), CULLET_BACKEND_CUDA, 0, 0, 0};
    CHECK(loaded.broadphase_create(12 - scalarBytes, NULL, &broadphase) == CULLET_ERROR_PRECISION);
    CHECK(strstr(loaded.last_error(), "precision") != NULL);
    CHECK(loaded.broadphase_create(3, NULL, &broadphase) == CULLET_ERROR_ARGUMENT);
    CHECK(broadphase == NULL);
    /* No GPU is a warning here, not an error. */
    loaded.set_log_function(countMessage);
    messageCount = 0;
    CHECK(loaded.broadphase_create(scalarBytes, &options, &broadphase) == CULLET_OK);
    CHECK(messageCount <= 1);
    loaded.set_log_function(NULL);
    CHECK(loaded.broadphase_interface(broadphase) != NULL);
    CHECK(loaded.broadphase_interface(NULL) == NULL);
    loaded.broadphase_destroy(broadphase);
    loaded.broadphase_destroy(NULL);
}

static void* readErrorOfNewThread(void* result)
{
    *(int*)result = (int)strlen(loaded.last_error());
    return NULL;
}

static void testErrorIsPerThread(void)
{
    pthread_t thread;
    int length = -1;
    CHECK(loaded.box_set_create(NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(strlen(loaded.last_error()) > 0);
    CHECK(pthread_create(&thread, NULL, readErrorOfNewThread, &length) == 0);
    CHECK(pthread_join(thread, NULL) == 0);
    CHECK(length == 0);
}

int main(int argc, char** argv)
{
    CHECK(argc == 3);
    for (int i = 1; i < argc; ++i)
    {
        void* library = dlopen(argv[i], RTLD_NOW | RTLD_LOCAL);
        if (library == NULL)
        {
            printf("%s\n", dlerror());
            return 1;
        }
        load(library);
        CHECK(loaded.abi_version() >= CULLET_ABI_VERSION);
        CHECK(loaded.precision() == 32 * i);
        testBoxes();
        testBroadphase(4u * (uint32_t)i);
        testErrorIsPerThread();
        CHECK(dlclose(library) == 0);
        /* It stays, since Bullet may hold functions of it. */
        CHECK(loaded.precision() == 32 * i);
    }
    return finish("open");
}
