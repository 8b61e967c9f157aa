#include "engine/io/gltf/buffers.h"

#include <nlohmann/json.hpp>

namespace halflight {
namespace {

using Json = nlohmann::json;

std::string name(int buffer_view) {
    return fmt::format("bufferViews[{}]", buffer_view);
}

/// Opens a buffer. Files may be longer than the buffer, and the binary chunk is padded.
ByteSource open_buffer(const Json& buffer, std::size_t index, GltfDocument& document, const ByteSource& binary_chunk) {
    static const std::string kNoUri;
    const std::string element = fmt::format("buffers[{}]", index);
    const std::string& uri = buffer.contains("uri") ? buffer["uri"].get_ref<const std::string&>() : kNoUri;
    const std::uint64_t length = buffer.at("byteLength");
    ByteSource bytes;
    if (!uri.empty()) bytes = document.open_uri(uri, element);
    if (uri.empty() && index == 0) bytes = binary_chunk;
    // A buffer without bytes is allowed while nothing reads it.
    if (uri.empty() && bytes.size() == 0) return bytes;
    if (bytes.size() < length) document.fail(element, "{} bytes, but byteLength is {}", bytes.size(), length);
    return bytes.part(0, length);
}

bool has_range(const ByteSource& buffer, const GltfMeshoptView& view) {
    // schema.h limits sizes to 2^53, so their sum does not overflow.
    return view.length > 0 && view.offset + view.length <= buffer.size();
}

}  // namespace

void take_buffers(Json& root, GltfDocument& document, const ByteSource& binary_chunk) {
    if (!root.contains("buffers")) return;
    const Json buffers = std::move(root["buffers"]);
    root.erase("buffers");
    std::vector<bool> unopened;
    for (std::size_t i = 0; i < buffers.size(); ++i) {
        unopened.push_back(is_meshopt_fallback(buffers[i]));
        document.buffers.emplace_back();
        try {
            if (buffers[i].at("byteLength") == 0) document.fail(fmt::format("buffers[{}]", i), "byteLength is 0");
            if (!unopened[i]) document.buffers[i] = open_buffer(buffers[i], i, document, binary_chunk);
        } catch (const Error& error) {
            document.tolerate_unused("buffers", i, error);
        }
    }
    if (!root.contains("bufferViews")) return;
    const Json& views = root["bufferViews"];
    for (int i = 0; i < static_cast<int>(views.size()); ++i) {
        const Json& view = views[static_cast<std::size_t>(i)];
        std::optional<GltfMeshoptView> compressed;
        try {
            compressed = read_meshopt_view(view, document.file + ": " + name(i));
        } catch (const Error& error) {
            document.tolerate_unused("bufferViews", static_cast<std::size_t>(i), error);
            continue;
        }
        const std::size_t own = view.at("buffer");
        if (!compressed && unopened[own]) {
            document.buffers[own] = open_buffer(buffers[own], own, document, binary_chunk);
            unopened[own] = false;
        }
        if (compressed) document.compressed_views[i] = *compressed;
    }
}

std::uint64_t GltfDocument::view_size(int buffer_view) const {
    if (const auto found = compressed_views.find(buffer_view); found != compressed_views.end()) {
        const GltfMeshoptView& view = found->second;
        const ByteSource& buffer = buffers[static_cast<std::size_t>(view.buffer)];
        if (!has_range(buffer, view))
            fail(name(buffer_view), "its compressed data ends at byte {} of buffers[{}], which has {}",
                 view.offset + view.length, view.buffer, buffer.size());
        std::string first;
        view.check_length(static_cast<unsigned char>(buffer.read(view.offset, 1, first)[0]),
                          file + ": " + name(buffer_view));
        return view.size();
    }
    // schema.h limits sizes to 2^53, so their sum does not overflow.
    const auto& view = model.bufferViews[static_cast<std::size_t>(buffer_view)];
    const ByteSource& buffer = buffers[static_cast<std::size_t>(view.buffer)];
    if (buffer.size() == 0)
        fail(fmt::format("buffers[{}]", view.buffer), "has no URI, and there is no binary chunk for it");
    if (view.byteOffset + view.byteLength > buffer.size())
        fail(name(buffer_view), "ends at byte {} of buffers[{}], which has {}", view.byteOffset + view.byteLength,
             view.buffer, buffer.size());
    return view.byteLength;
}

ByteSource GltfDocument::view_bytes(int buffer_view) const {
    const std::uint64_t size = view_size(buffer_view);
    const auto found = compressed_views.find(buffer_view);
    if (found == compressed_views.end()) {
        const auto& view = model.bufferViews[static_cast<std::size_t>(buffer_view)];
        return buffers[static_cast<std::size_t>(view.buffer)].part(view.byteOffset, size);
    }
    const std::scoped_lock lock(decoded->mutex);
    if (const auto known = decoded->views.find(buffer_view); known != decoded->views.end()) return known->second.bytes;
    const GltfMeshoptView& view = found->second;
    MemoryLedger::process().check(size + view.length, file, name(buffer_view));
    std::string buffer;
    const std::string_view compressed =
        buffers[static_cast<std::size_t>(view.buffer)].read(view.offset, view.length, buffer);
    const ByteSource bytes(view.decode(compressed, file + ": " + name(buffer_view)));
    decoded->views[buffer_view] = {bytes, {MemoryLedger::process(), MemoryPart::scene, size}};
    return bytes;
}

}  // namespace halflight
