// The peer of `octray rays`: Embree 3 on the same geometry and the same rays, eight at a time.
//
//   g++ -std=c++17 -O3 -march=native embree.cpp -o embree -lembree3
//   ./embree (--mesh FILE.mesh | --spheres FILE.sph) [--robust] [--high] [--repeat N] [--answers SUFFIX] SET.rays...
//
// Files are those of `octray rays --help`. Each set is traced with the coherent and with the incoherent flag, one after
// the other in every repetition, by one thread; a line of JSON per set and flag has the median, in processor time.
// Rays are loaded from columns and hits written to columns, as in octray. `differs` counts rays whose answer is not
// the one stored in the file. `--robust` asks for edges without cracks and boxes that lose no hit, `--high` for the tree of high
// quality (triangles split among boxes), `--answers SUFFIX` writes SET.raysSUFFIX: the same rays with the answers given here.
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>
#include <xmmintrin.h>

namespace {
constexpr unsigned kLanes = 8;
constexpr float kSameDistance = 1e-5f;  // as octray's ray_set

[[noreturn]] void fail(const std::string& why) {
    std::fprintf(stderr, "embree: %s\n", why.c_str());
    std::exit(3);
}

std::vector<char> bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) fail("cannot read " + path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

uint32_t count_at(const std::vector<char>& bytes, size_t at) {
    uint32_t n = 0;
    if (bytes.size() < at + 4) fail("a file is cut off");
    std::memcpy(&n, &bytes[at], 4);
    return n;
}

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct Set {
    uint32_t n = 0, any = 0;
    std::vector<float> column[8];  // origin, direction, near, far; padded to whole packets with dead rays
    std::vector<float> known_t;
    std::vector<uint32_t> known;
};

Set read_set(const std::string& path) {
    const auto bytes = bytes_of(path);
    Set set;
    set.n = count_at(bytes, 8);
    set.any = count_at(bytes, 12);
    if (std::memcmp(bytes.data(), "RAYS0001", 8) != 0 || bytes.size() != 16 + 40 * size_t(set.n)) fail(path + " is no ray file");
    const size_t padded = (set.n + kLanes - 1) / kLanes * kLanes;
    const char* at = bytes.data() + 16;
    for (int k = 0; k < 8; k++, at += 4 * size_t(set.n)) {
        set.column[k].assign(padded, k == 6 ? 1.0f : k == 7 ? -1.0f : 1.0f);
        std::memcpy(set.column[k].data(), at, 4 * size_t(set.n));
    }
    set.known_t.resize(set.n);
    set.known.resize(set.n);
    std::memcpy(set.known_t.data(), at, 4 * size_t(set.n));
    std::memcpy(set.known.data(), at + 4 * size_t(set.n), 4 * size_t(set.n));
    return set;
}

RTCScene build(RTCDevice device, const std::string& path, bool spheres, bool robust, bool high, double* seconds, uint32_t* primitives) {
    const auto bytes = bytes_of(path);
    const uint32_t n = count_at(bytes, 8), m = count_at(bytes, 12);
    RTCGeometry geometry;
    if (spheres) {
        geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, n), &bytes[16], 16 * size_t(n));
        *primitives = n;
    } else {
        geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, n), &bytes[16], 12 * size_t(n));
        std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, m), &bytes[16 + 12 * size_t(n)], 12 * size_t(m));
        *primitives = m;
    }
    const double begin = cpu_seconds();
    RTCScene scene = rtcNewScene(device);
    if (robust) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    if (high) rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    *seconds = cpu_seconds() - begin;
    return scene;
}

bool count_bytes(void* held, ssize_t bytes, bool) {
    *static_cast<ssize_t*>(held) += bytes;
    return true;
}

template <class Ray> void load(Ray& ray, const Set& set, size_t first) {
    float* to[8] = {ray.org_x, ray.org_y, ray.org_z, ray.dir_x, ray.dir_y, ray.dir_z, ray.tnear, ray.tfar};
    for (int k = 0; k < 8; k++) std::memcpy(to[k], &set.column[k][first], 4 * kLanes);
    std::memset(ray.time, 0, sizeof ray.time);
    std::memset(ray.mask, 0xff, sizeof ray.mask);
    std::memset(ray.id, 0, sizeof ray.id);
    std::memset(ray.flags, 0, sizeof ray.flags);
}

double trace(RTCScene scene, bool coherent, const Set& set, std::vector<float>& t, std::vector<uint32_t>& hit) {
    alignas(32) static const int all[kLanes] = {-1, -1, -1, -1, -1, -1, -1, -1};
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const double begin = cpu_seconds();
    for (size_t first = 0; first < t.size(); first += kLanes) {
        if (set.any) {
            alignas(32) RTCRay8 ray;
            load(ray, set, first);
            rtcOccluded8(all, scene, &context, &ray);
            std::memcpy(&t[first], ray.tfar, 4 * kLanes);
        } else {
            alignas(32) RTCRayHit8 both;
            load(both.ray, set, first);
            std::memset(both.hit.geomID, 0xff, sizeof both.hit.geomID);
            std::memset(both.hit.primID, 0xff, sizeof both.hit.primID);
            std::memset(both.hit.instID, 0xff, sizeof both.hit.instID);
            rtcIntersect8(all, scene, &context, &both);
            std::memcpy(&t[first], both.ray.tfar, 4 * kLanes);
            std::memcpy(&hit[first], both.hit.primID, 4 * kLanes);
        }
    }
    return cpu_seconds() - begin;
}

void write_answers(const std::string& path, const std::string& suffix, const Set& set, const std::vector<float>& t, const std::vector<uint32_t>& hit) {
    auto bytes = bytes_of(path);
    char* at = bytes.data() + 16 + 32 * size_t(set.n);
    std::vector<uint32_t> answer(hit.begin(), hit.begin() + set.n);
    if (set.any)
        for (size_t k = 0; k < set.n; k++) answer[k] = t[k] < 0;
    std::memcpy(at, t.data(), 4 * size_t(set.n));
    std::memcpy(at + 4 * size_t(set.n), answer.data(), 4 * size_t(set.n));
    std::ofstream file(path + suffix, std::ios::binary);
    file.write(bytes.data(), std::streamsize(bytes.size()));
    if (!file) fail("cannot write " + path + suffix);
}

size_t differing(const Set& set, const std::vector<float>& t, const std::vector<uint32_t>& hit) {
    size_t n = 0;
    for (size_t k = 0; k < set.n; k++) {
        if (set.any) {
            n += (t[k] < 0) != (set.known[k] != 0);
            continue;
        }
        const bool none = hit[k] == ~0u, known_none = set.known[k] == ~0u;
        const float most = std::max(std::fabs(t[k]), std::fabs(set.known_t[k]));
        n += none != known_none || (!none && !(std::fabs(t[k] - set.known_t[k]) <= kSameDistance * most));
    }
    return n;
}
}  // namespace

int main(int argc, char** argv) {
    std::string geometry;
    bool spheres = false, robust = false, high = false;
    int repeat = 1;
    std::string suffix;
    std::vector<std::string> sets;
    for (int k = 1; k < argc; k++) {
        const std::string word = argv[k];
        if ((word == "--mesh" || word == "--spheres") && k + 1 < argc) spheres = word == "--spheres", geometry = argv[++k];
        else if (word == "--robust") robust = true;
        else if (word == "--high") high = true;
        else if (word == "--answers" && k + 1 < argc) suffix = argv[++k];
        else if (word == "--repeat" && k + 1 < argc) repeat = std::max(1, std::atoi(argv[++k]));
        else sets.push_back(word);
    }
    if (geometry.empty()) fail("say --mesh or --spheres");
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _mm_setcsr(_mm_getcsr() | 0x0040);  // Denormals are zero: what Embree's documentation asks for.
    RTCDevice device = rtcNewDevice("threads=1");
    if (!device) fail("no device");
    ssize_t held = 0;  // Tree and geometry.
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, &held);
    double build_s = 0;
    uint32_t primitives = 0;
    RTCScene scene = build(device, geometry, spheres, robust, high, &build_s, &primitives);
    for (const auto& path : sets) {
        const Set set = read_set(path);
        std::vector<float> t(set.column[0].size());
        std::vector<uint32_t> hit(t.size(), ~0u);
        std::vector<double> seconds[2];
        size_t differs[2] = {};
        for (int round = 0; round < repeat; round++)
            for (int coherent = 0; coherent < 2; coherent++) {
                seconds[coherent].push_back(trace(scene, coherent, set, t, hit));
                differs[coherent] = differing(set, t, hit);
            }
        if (!suffix.empty()) write_answers(path, suffix, set, t, hit);
        for (int coherent = 0; coherent < 2; coherent++) {
            auto& s = seconds[coherent];
            std::sort(s.begin(), s.end());
            const double median = s[s.size() / 2];
            std::printf("{\"set\":\"%s\",\"coherent\":%s,\"rays\":%u,\"mrays_cpu_s\":%.4f,\"build_cpu_s\":%.4f,\"primitives\":%u,\"bytes\":%zd,\"differs\":%zu}\n",
                        path.c_str(), coherent ? "true" : "false", set.n, set.n * 1e-6 / median, build_s, primitives, held, differs[coherent]);
        }
    }
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}
