#include <OpenColorIO/OpenColorIO.h>
#include <OpenEXR/OpenEXRConfig.h>
#include <fmt/format.h>
#include <png.h>
#include <tbb/version.h>
#include <zstd.h>

#include "api/sequence/source_hash.h"
#include "engine/core/embree.h"
#include "engine/gpu/context.h"
#include "engine/gpu/driver_needs.h"
#include "tools/halflight/commands.h"

namespace halflight {
namespace {

/// Returns the driver of the device that `halflight render` takes by default, or why there is none.
std::string driver() {
    try {
        gpu::prepare_process();
        const gpu::Context context = gpu::Context::create();
        return fmt::format("{}, OpenGL {}", context.renderer(), context.version());
    } catch (const Error& error) {
        return fmt::format("none: {}", error.what());
    }
}

std::string embree_version() {
    const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
    const auto part = [&](RTCDeviceProperty property) { return rtcGetDeviceProperty(device.get(), property); };
    return fmt::format("{}.{}.{}", part(RTC_DEVICE_PROPERTY_VERSION_MAJOR), part(RTC_DEVICE_PROPERTY_VERSION_MINOR),
                       part(RTC_DEVICE_PROPERTY_VERSION_PATCH));
}

}  // namespace

void print_version() {
    fmt::print("halflight {}\nbuild: {}, {}\ndriver: {}\n", HALFLIGHT_VERSION, source_hash(), HALFLIGHT_COMPILER,
               driver());
    fmt::print("libraries: Embree {}, OpenColorIO {}, OpenEXR {}, oneTBB {}, libpng {}, Zstandard {}\n",
               embree_version(), OCIO_NAMESPACE::GetVersion(), OPENEXR_VERSION_STRING, TBB_runtime_version(),
               png_get_libpng_ver(nullptr), ZSTD_versionString());
}

}  // namespace halflight
