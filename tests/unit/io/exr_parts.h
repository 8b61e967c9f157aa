// OpenEXR files as other programs write them: several parts with windows of their own, deep data, any attributes.
#pragma once

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace halflight::test {

/// A channel of floats: its value by pixel, of which files have each `step`-th one along x and y.
struct PartChannel {
    std::function<float(int x, int y)> value;
    int step = 1;
};

struct ExrPart {
    std::string name;
    Imath::Box2i window;  // data window
    std::map<std::string, PartChannel> channels{};
    bool deep = false;  // deep data without any sample
};

inline PartChannel constant(float value) {
    return {[value](int, int) { return value; }};
}

/// Writes a file of one part or several. adapt: changes the header of each.
inline void write_exr_parts(const std::filesystem::path& path, const Imath::Box2i& display,
                            const std::vector<ExrPart>& parts, const std::function<void(Imf::Header&)>& adapt = {}) {
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts) {
        Imf::Header& header = headers.emplace_back(display, part.window);
        header.setType(part.deep ? Imf::DEEPSCANLINE : Imf::SCANLINEIMAGE);
        header.setName(part.name);
        header.compression() = Imf::ZIPS_COMPRESSION;
        for (const auto& [name, channel] : part.channels)
            header.channels().insert(name, Imf::Channel(Imf::FLOAT, channel.step, channel.step));
        if (adapt) adapt(header);
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const Imath::Box2i& window = parts[i].window;
        const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
        if (parts[i].deep) {
            const std::vector<unsigned> counts(static_cast<std::size_t>(width * height), 0);
            const std::vector<float*> samples(counts.size(), nullptr);
            Imf::DeepFrameBuffer buffer;
            buffer.insertSampleCountSlice(Imf::Slice::Make(Imf::UINT, counts.data(), window));
            const auto row = static_cast<std::ptrdiff_t>(width);
            char* const base = reinterpret_cast<char*>(const_cast<float**>(samples.data()) - window.min.y * row -
                                                       window.min.x);
            for (const auto& [name, channel] : parts[i].channels)
                buffer.insert(name, Imf::DeepSlice(Imf::FLOAT, base, sizeof(float*),
                                                   sizeof(float*) * static_cast<std::size_t>(width), sizeof(float)));
            Imf::DeepScanLineOutputPart part(file, static_cast<int>(i));
            part.setFrameBuffer(buffer);
            part.writePixels(height);
            continue;
        }
        std::map<std::string, std::vector<float>> planes;
        for (const auto& [name, channel] : parts[i].channels)
            for (int y = window.min.y; y <= window.max.y; y += channel.step)
                for (int x = window.min.x; x <= window.max.x; x += channel.step)
                    planes[name].push_back(channel.value(x, y));
        Imf::FrameBuffer buffer;
        for (const auto& [name, channel] : parts[i].channels)
            buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, planes[name].data(), window, 0, 0, channel.step,
                                                 channel.step));
        Imf::OutputPart part(file, static_cast<int>(i));
        part.setFrameBuffer(buffer);
        part.writePixels(height);
    }
}

}  // namespace halflight::test
