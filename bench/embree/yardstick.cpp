// Embree on one thread, as a yardstick for benches/embree.rs, which writes the file of triangles and rays and gives the
// commands: one line per command on standard input, one line back.
//
//   yardstick FILE [robust]     prints "VERSION NANOSECONDS", the time of the build
//   closest SET | any SET | closest8 SET       prints "HITS NANOSECONDS"
//
// Times are CPU times of the thread. The file: vertices, triangles and the sets of rays, each with its number as u32 in
// front; a ray is origin, direction and greatest distance, seven floats.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <pmmintrin.h>
#include <vector>

struct Ray {
    float origin[3], direction[3], far;
};

static long nanoseconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec * 1000000000L + t.tv_nsec;
}

template <class T> static std::vector<T> read_array(FILE *file) {
    unsigned count = 0;
    std::vector<T> values;
    if (fread(&count, 4, 1, file) == 1) values.resize(count);
    if (fread(values.data(), sizeof(T), count, file) != count) exit(1);
    return values;
}

template <class T> static void copy(RTCGeometry mesh, RTCBufferType type, RTCFormat format, const std::vector<T> &from) {
    void *buffer = rtcSetNewGeometryBuffer(mesh, type, 0, format, sizeof(T), from.size());
    memcpy(buffer, from.data(), from.size() * sizeof(T));
}

static void fill(RTCRay &to, const Ray &from) {
    to.org_x = from.origin[0], to.org_y = from.origin[1], to.org_z = from.origin[2];
    to.dir_x = from.direction[0], to.dir_y = from.direction[1], to.dir_z = from.direction[2];
    to.tnear = 0, to.tfar = from.far, to.time = 0, to.mask = ~0u, to.id = 0, to.flags = 0;
}

#if RTC_VERSION_MAJOR >= 4
#define INTERSECT1(scene, ray) rtcIntersect1(scene, ray)
#define INTERSECT8(valid, scene, ray) rtcIntersect8(valid, scene, ray)
#define OCCLUDED1(scene, ray) rtcOccluded1(scene, ray)
#else
#define INTERSECT1(scene, ray) rtcIntersect1(scene, &context, ray)
#define INTERSECT8(valid, scene, ray) rtcIntersect8(valid, scene, &context, ray)
#define OCCLUDED1(scene, ray) rtcOccluded1(scene, &context, ray)
#endif

static long closest(RTCScene scene, const std::vector<Ray> &rays) {
#if RTC_VERSION_MAJOR < 4
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    long hits = 0;
    for (const Ray &ray : rays) {
        RTCRayHit query;
        fill(query.ray, ray);
        query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        INTERSECT1(scene, &query);
        hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
}

static long any(RTCScene scene, const std::vector<Ray> &rays) {
#if RTC_VERSION_MAJOR < 4
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    long hits = 0;
    for (const Ray &ray : rays) {
        RTCRay query;
        fill(query, ray);
        OCCLUDED1(scene, &query);
        hits += query.tfar < 0;
    }
    return hits;
}

// Eight neighbours at a time, which this library does not do.
static long closest8(RTCScene scene, const std::vector<Ray> &rays) {
#if RTC_VERSION_MAJOR < 4
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
    long hits = 0;
    for (size_t first = 0; first < rays.size(); first += 8) {
        alignas(32) int valid[8];
        alignas(32) RTCRayHit8 query;
        for (size_t lane = 0; lane < 8; lane++) {
            valid[lane] = first + lane < rays.size() ? -1 : 0;
            const Ray &ray = rays[std::min(first + lane, rays.size() - 1)];
            query.ray.org_x[lane] = ray.origin[0], query.ray.dir_x[lane] = ray.direction[0];
            query.ray.org_y[lane] = ray.origin[1], query.ray.dir_y[lane] = ray.direction[1];
            query.ray.org_z[lane] = ray.origin[2], query.ray.dir_z[lane] = ray.direction[2];
            query.ray.tnear[lane] = 0, query.ray.tfar[lane] = ray.far, query.ray.time[lane] = 0;
            query.ray.mask[lane] = ~0u, query.ray.id[lane] = 0, query.ray.flags[lane] = 0;
            query.hit.geomID[lane] = query.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        }
        INTERSECT8(valid, scene, &query);
        for (int lane = 0; lane < 8; lane++)
            hits += valid[lane] && query.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
}

int main(int count, char **arguments) {
    FILE *file = count > 1 ? fopen(arguments[1], "rb") : nullptr;
    if (!file) return fprintf(stderr, "usage: yardstick FILE [robust]\n"), 1;
    struct Corner { float x, y, z; };
    struct Triangle { unsigned a, b, c; };
    auto corners = read_array<Corner>(file);
    auto triangles = read_array<Triangle>(file);
    std::vector<Ray> sets[3];
    for (auto &set : sets) set = read_array<Ray>(file);
    fclose(file);

    // What Embree's manual advises.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    RTCDevice device = rtcNewDevice(getenv("EMBREE_CONFIG") ? getenv("EMBREE_CONFIG") : "threads=1,user_threads=1");
    RTCScene scene = rtcNewScene(device);
    if (count > 2 && !strcmp(arguments[2], "robust")) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    copy(mesh, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, corners);
    copy(mesh, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
    rtcAttachGeometry(scene, mesh);
    long start = nanoseconds();
    rtcCommitGeometry(mesh);
    rtcCommitScene(scene);
    printf("%s %ld\n", RTC_VERSION_STRING, nanoseconds() - start);
    fflush(stdout);

    char what[16];
    unsigned set;
    while (scanf("%15s %u", what, &set) == 2 && set < 3) {
        auto run = !strcmp(what, "any") ? any : !strcmp(what, "closest8") ? closest8 : closest;
        start = nanoseconds();
        long hits = run(scene, sets[set]);
        printf("%ld %ld\n", hits, nanoseconds() - start);
        fflush(stdout);
    }
}
