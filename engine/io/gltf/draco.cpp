#include "engine/io/gltf/draco.h"

#include <draco/compression/entropy/symbol_decoding.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "engine/core/memory_ledger.h"

namespace halflight {
namespace {

// Working memory of the decoder (measured with grids of 10^4 to 10^6 triangles, and rounded up).
constexpr std::size_t kBytesPerTriangle = 96;
constexpr std::size_t kBytesPerAttribute = 64;  // per triangle and attribute, or set of attribute seams
// The tables of the library's entropy decoder are the worst case for the length of the data. A byte stands for up to 64
// symbols that do not occur, and the library allocates 12 bytes for each of them. Real tables have at most 2^18
// symbols. Only the first MiB is therefore charged for tables: scans of 10 MiB would need 8 GiB otherwise. A hostile
// file of more than a MiB can take more than it is charged. The rest is for attribute headers and a copy.
constexpr std::size_t kTableBytesPerByte = 64 * 12;
constexpr std::size_t kMostTableData = std::size_t{1} << 20;
constexpr std::size_t kBytesPerByte = 64 + 1;
// Triangles that a byte may hold. A regular grid needs less than a bit per triangle; only a bomb exceeds this limit.
constexpr std::size_t kMostTrianglesPerByte = 8192;

// Bytes of metadata, headers and attributes without a name in glTF; other data is shorter than what it encodes.
constexpr std::size_t kMostOtherBytes = std::size_t{1} << 20;

constexpr std::size_t kHeaderBytes = 11;                    // bytes of draco::DracoHeader without padding
constexpr std::size_t kPrefixBytes = std::size_t{1} << 12;  // bytes that hold the counts unless metadata is long

struct Header {
    bool edgebreaker = false;
    std::uint32_t triangles = 0;
    std::uint32_t vertices = 0;  // Vertex count; Edgebreaker counts vertices before seams split them.
    std::uint8_t seam_sets = 0;  // sets of attribute seams
};

bool skip(draco::DecoderBuffer& buffer, std::uint64_t bytes) {
    if (bytes > static_cast<std::uint64_t>(buffer.remaining_size())) return false;
    buffer.Advance(static_cast<std::int64_t>(bytes));
    return true;
}

bool skip_name(draco::DecoderBuffer& buffer) {
    std::uint8_t length = 0;
    return buffer.Decode(&length) && skip(buffer, length);
}

/// Skips a tree of metadata, whose nodes stand in depth-first order. Returns false for damaged metadata, for which the
/// library's decoder could need memory quadratic in its length.
bool skip_metadata_tree(draco::DecoderBuffer& buffer) {
    bool is_root = true;  // the root has no name
    for (std::uint64_t nodes = 1; nodes > 0; --nodes) {
        if (!is_root && !skip_name(buffer)) return false;
        is_root = false;
        std::uint32_t entries = 0, children = 0, size = 0;
        if (!draco::DecodeVarint(&entries, &buffer)) return false;
        for (; entries > 0; --entries)
            if (!skip_name(buffer) || !draco::DecodeVarint(&size, &buffer) || !skip(buffer, size)) return false;
        if (!draco::DecodeVarint(&children, &buffer)) return false;
        nodes += children;
    }
    return true;
}

bool skip_metadata(draco::DecoderBuffer& buffer) {
    std::uint32_t attributes = 0, id = 0;
    if (!draco::DecodeVarint(&attributes, &buffer)) return false;
    for (; attributes > 0; --attributes)
        if (!draco::DecodeVarint(&id, &buffer) || !skip_metadata_tree(buffer)) return false;
    return skip_metadata_tree(buffer);
}

draco::DecoderBuffer buffer_of(std::string_view bytes) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size(), DRACO_BITSTREAM_VERSION(2, 2));
    return buffer;
}

/// Reads what stands before the connectivity. None if it is damaged.
std::optional<Header> read_counts(std::string_view bytes, const draco::DracoHeader& start) {
    draco::DecoderBuffer buffer = buffer_of(bytes);
    Header header;
    if (!skip(buffer, kHeaderBytes)) return std::nullopt;
    if ((start.flags & METADATA_FLAG_MASK) != 0 && !skip_metadata(buffer)) return std::nullopt;
    header.edgebreaker = start.encoder_method == draco::MESH_EDGEBREAKER_ENCODING;
    if (!header.edgebreaker) {
        if (!draco::DecodeVarint(&header.triangles, &buffer) || !draco::DecodeVarint(&header.vertices, &buffer))
            return std::nullopt;
        return header;
    }
    std::uint8_t traversal = 0;
    if (!buffer.Decode(&traversal) || !draco::DecodeVarint(&header.vertices, &buffer) ||
        !draco::DecodeVarint(&header.triangles, &buffer) || !buffer.Decode(&header.seam_sets))
        return std::nullopt;
    return header;
}

/// The compressed data of a primitive. Its counts may differ from those of the accessors.
struct Source {
    ByteSource data;
    Header header;
    std::size_t triangles = 0;  // triangles that the accessors have
    std::size_t vertices = 0;   // vertices that the accessors have
    const tinygltf::Value::Object* attributes = nullptr;

    /// Returns the largest number of vertices after seams have split them: one per corner.
    std::size_t most_split() const { return header.edgebreaker ? std::size_t{header.triangles} * 3 : header.vertices; }
    /// Returns the number of vertices to expect after seams have split them.
    std::size_t most_vertices() const {
        return header.edgebreaker && header.vertices <= vertices ? std::min(vertices, most_split()) : most_split();
    }
    std::size_t decoding_bytes() const {
        const std::size_t sets = std::max<std::size_t>(header.seam_sets, attributes->size());
        return header.triangles * (kBytesPerTriangle + kBytesPerAttribute * sets) + kBytesPerByte * data.size() +
               kTableBytesPerByte * std::min(data.size(), kMostTableData);
    }
};

/// Reads the header of the data, and what stands before the connectivity. Throws Error for what is not supported.
Header read_header(const ByteSource& data, const GltfDocument& document, const std::string& element) {
    std::string read;
    const auto prefix = [&](std::size_t bytes) { return data.read(0, std::min(data.size(), bytes), read); };
    draco::DecoderBuffer buffer = buffer_of(prefix(kHeaderBytes));
    draco::DracoHeader start{};
    if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &start).ok())
        document.fail(element, "its Draco data has no header");
    if (start.version_major != 2 || start.version_minor != 2)
        document.fail(element, "its Draco data has version {}.{}, only 2.2 is supported", start.version_major,
                      start.version_minor);
    if (start.encoder_type != draco::TRIANGULAR_MESH || start.encoder_method > draco::MESH_EDGEBREAKER_ENCODING)
        document.fail(element, "its Draco data is no triangle mesh");
    std::optional<Header> header = read_counts(prefix(kPrefixBytes), start);
    if (!header && data.size() > kPrefixBytes) {
        MemoryLedger::process().check(data.size(), document.file + ": " + element, "Draco metadata");
        header = read_counts(prefix(data.size()), start);
    }
    if (!header) document.fail(element, "its Draco data has a damaged header");
    return *header;
}

std::optional<Source> open_source(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                  const std::string& element) {
    const tinygltf::Value* extension = find_extension(primitive.extensions, "KHR_draco_mesh_compression");
    if (!extension) return std::nullopt;
    const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP;
    if (!strip && primitive.mode != TINYGLTF_MODE_TRIANGLES)
        document.fail(element, "KHR_draco_mesh_compression allows triangles and triangle strips only");
    Source source;
    source.attributes = &extension->Get("attributes").Get<tinygltf::Value::Object>();
    const GltfAccessors accessors(document);
    const int position = primitive.attributes.at("POSITION");
    const std::size_t corners = accessors.count(primitive.indices == kNone ? position : primitive.indices);
    source.triangles = strip ? corners - std::min<std::size_t>(corners, 2) : corners / 3;
    source.vertices = accessors.count(position);

    source.data = document.view_bytes(extension->Get("bufferView").GetNumberAsInt());
    source.header = read_header(source.data, document, element);
    const Header& header = source.header;
    // Vertices that no triangle uses may take no bytes. The accessors alone can vouch for them.
    if (header.vertices > std::max(source.vertices, std::size_t{header.triangles} * 3))
        document.fail(element, "its Draco data has {} vertices for {} triangles, its accessors {}", header.vertices,
                      header.triangles, source.vertices);
    if (header.triangles / kMostTrianglesPerByte > source.data.size())
        document.fail(element, "its Draco data cannot have {} triangles in {} bytes", header.triangles,
                      source.data.size());
    // Twice the bytes of the uncompressed triangles and vertices, since the encoder lengthens random numbers.
    std::size_t each = 0;  // bytes of a vertex
    for (const auto& [name, id] : *source.attributes)
        if (const auto found = primitive.attributes.find(name); found != primitive.attributes.end())
            each += sizeof(float) * static_cast<std::size_t>(accessors.components(found->second));
    const std::size_t most = 2 * (std::size_t{header.triangles} * sizeof(uvec3) + source.most_split() * each);
    if (source.data.size() > most + kMostOtherBytes)
        document.fail(element, "its Draco data has {} bytes, too many for {} triangles and {} vertices",
                      source.data.size(), header.triangles, source.most_split());
    return source;
}

/// A decoder of the library that checks the sizes of attributes before it decodes them.
template <class Base>
class Checked final : public Base {
  public:
    Checked(const GltfDocument& document, const std::string& element, std::size_t most_vertices,
            const draco::DecoderBuffer& buffer)
        : document_(document), element_(element), most_vertices_(most_vertices), buffer_(buffer) {}

  private:
    bool DecodeAllAttributes() override {
        const draco::Mesh& mesh = *this->mesh();
        if (mesh.num_points() > most_vertices_)
            document_.fail(element_, "its Draco data has {} vertices, more than {}", mesh.num_points(), most_vertices_);
        std::size_t values = mesh.num_points();
        if (const draco::CornerTable* table = this->GetCornerTable())
            values = std::max<std::size_t>(values, static_cast<std::size_t>(table->num_vertices()));
        std::size_t each = 0;  // bytes per vertex: values, integers that predict them, places
        for (int i = 0; i < mesh.num_attributes(); ++i) {
            const draco::PointAttribute& attribute = *mesh.attribute(i);
            each += static_cast<std::size_t>(attribute.byte_stride()) + 8u * attribute.num_components() + 16;
        }
        MemoryLedger::process().check(values * each, document_.file + ": " + element_, "Draco attributes");
        return Base::DecodeAllAttributes();
    }

    /// The library asks for these data when it has read the prediction scheme of an attribute. The number of
    /// orientations in the scheme for texture coordinates is checked here, because the library would decode up to 2^31.
    const draco::MeshAttributeIndicesEncodingData* GetAttributeEncodingData(int attribute) const override {
        const char method = buffer_.data_head()[-2];  // before the transform, which is a byte, too
        const bool bad = method == draco::MESH_PREDICTION_TEX_COORDS_DEPRECATED ||
                         (method == draco::MESH_PREDICTION_TEX_COORDS_PORTABLE &&
                          !orientations_fit(*this->mesh()->attribute(attribute)));
        if (bad) document_.fail(element_, "its Draco data is damaged: texture coordinates");
        return Base::GetAttributeEncodingData(attribute);
    }

    bool orientations_fit(const draco::PointAttribute& attribute) const {
        draco::DecoderBuffer ahead = buffer_;
        const auto components = static_cast<int>(attribute.num_components());
        std::vector<std::uint32_t> values(attribute.size() * static_cast<std::size_t>(components));
        std::uint8_t compressed = 0, bytes = 0;
        std::uint32_t orientations = 0;
        if (!ahead.Decode(&compressed)) return false;
        if (compressed != 0 &&
            !draco::DecodeSymbols(static_cast<std::uint32_t>(values.size()), components, &ahead, values.data()))
            return false;
        if (compressed == 0 && (!ahead.Decode(&bytes) || !skip(ahead, bytes * values.size()))) return false;
        return ahead.Decode(&orientations) && orientations <= values.size();
    }

    const GltfDocument& document_;
    const std::string& element_;
    const std::size_t most_vertices_;
    const draco::DecoderBuffer& buffer_;
};

template <class T>
bool convert(const draco::Mesh& mesh, const draco::PointAttribute& from, std::string& to) {
    const std::size_t components = from.num_components();
    to.resize(mesh.num_points() * components * sizeof(T));
    std::vector<T> value(components);
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
        const draco::AttributeValueIndex place = from.mapped_index(draco::PointIndex(i));
        if (place.value() >= from.size() ||
            !from.ConvertValue<T>(place, static_cast<std::int8_t>(components), value.data()))
            return false;
        std::memcpy(to.data() + i * components * sizeof(T), value.data(), components * sizeof(T));
    }
    return true;
}

/// Converts an attribute to the type of an accessor. Returns false for values that do not fit.
bool convert(const draco::Mesh& mesh, const draco::PointAttribute& from, int component_type, std::string& to) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return convert<std::int8_t>(mesh, from, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return convert<std::uint8_t>(mesh, from, to);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return convert<std::int16_t>(mesh, from, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return convert<std::uint16_t>(mesh, from, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return convert<std::uint32_t>(mesh, from, to);
        default:
            return convert<float>(mesh, from, to);
    }
}

template <class Base>
void decode(const Source& source, const GltfDocument& document, const std::string& element, draco::Mesh& mesh) {
    std::string read;
    draco::DecoderBuffer buffer = buffer_of(source.data.read(0, source.data.size(), read));
    const draco::DecoderOptions options;
    Checked<Base> decoder(document, element, std::max(source.vertices, source.most_split()), buffer);
    try {
        const draco::Status status = decoder.Decode(options, &buffer, &mesh);
        if (!status.ok()) document.fail(element, "its Draco data is damaged: {}", status.error_msg());
    } catch (const std::out_of_range&) {  // from std::vector::at(), which the library calls with decoded indices
        document.fail(element, "its Draco data is damaged");
    }
}

/// Returns the corners of the triangles. Throws Error for damaged ones.
std::vector<std::uint32_t> indices_of(const draco::Mesh& mesh, const GltfDocument& document,
                                      const std::string& element) {
    std::vector<std::uint32_t> indices;
    indices.reserve(std::size_t{mesh.num_faces()} * 3);
    for (std::uint32_t i = 0; i < mesh.num_faces(); ++i)
        for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(i))) {
            if (corner.value() >= mesh.num_points())
                document.fail(element, "its Draco data is damaged: index {} of {} vertices", corner.value(),
                              mesh.num_points());
            indices.push_back(corner.value());
        }
    return indices;
}

bool has_data(const GltfDocument& document, int accessor) {
    const tinygltf::Accessor& a = document.model.accessors[static_cast<std::size_t>(accessor)];
    return a.bufferView != kNone || a.sparse.isSparse;
}

}  // namespace

bool has_elements(const GltfDocument& document, const tinygltf::Primitive& primitive, const std::string& attribute) {
    const tinygltf::Value* extension = find_extension(primitive.extensions, "KHR_draco_mesh_compression");
    return !extension || extension->Get("attributes").Has(attribute) ||
           has_data(document, primitive.attributes.at(attribute));
}

std::optional<GltfPrimitiveSize> measure_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                               const std::string& element) {
    const std::optional<Source> source = open_source(document, primitive, element);
    if (!source) return std::nullopt;
    return GltfPrimitiveSize{source->most_vertices(), source->header.triangles, source->decoding_bytes()};
}

std::optional<GltfDracoMesh> decode_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                          const std::string& element) {
    const std::optional<Source> source = open_source(document, primitive, element);
    if (!source) return std::nullopt;
    MemoryLedger& ledger = MemoryLedger::process();
    const std::string subject = document.file + ": " + element;
    ledger.check(source->decoding_bytes(), subject, "Draco connectivity");
    const MemoryLedger::Entry working(ledger, MemoryPart::scene, source->decoding_bytes());
    draco::Mesh mesh;
    if (source->header.edgebreaker)
        decode<draco::MeshEdgebreakerDecoder>(*source, document, element, mesh);
    else
        decode<draco::MeshSequentialDecoder>(*source, document, element, mesh);

    GltfDracoMesh decoded;
    decoded.indices = indices_of(mesh, document, element);
    decoded.has_other_counts = mesh.num_points() != source->vertices ||
                               (primitive.mode == TINYGLTF_MODE_TRIANGLES && mesh.num_faces() != source->triangles);
    const GltfAccessors accessors(document);
    for (const auto& [name, number] : *source->attributes) {
        const auto found = primitive.attributes.find(name);
        if (found == primitive.attributes.end()) continue;
        const auto id = static_cast<std::uint32_t>(number.GetNumberAsInt());
        const draco::PointAttribute* const from = mesh.GetAttributeByUniqueId(id);
        if (!from) {
            if (has_data(document, found->second)) decoded.beside.push_back(name);
            continue;
        }
        const std::size_t size = accessors.element_size(found->second) * mesh.num_points();
        if (accessors.components(found->second) != from->num_components())
            document.fail(element, "{} has {} components in its Draco data, and {} in accessors[{}]", name,
                          from->num_components(), accessors.components(found->second), found->second);
        ledger.check(size, subject, name);
        MemoryLedger::Entry memory(ledger, MemoryPart::scene, size);
        std::string bytes;
        const int type = document.model.accessors[static_cast<std::size_t>(found->second)].componentType;
        if (!convert(mesh, *from, type, bytes))
            document.fail(element, "{} in its Draco data does not fit into accessors[{}]", name, found->second);
        decoded.accessors[found->second] = {ByteSource(std::move(bytes)), mesh.num_points(), std::move(memory)};
    }
    for (const auto& [name, accessor] : primitive.attributes)
        if (!decoded.accessors.contains(accessor) && !has_data(document, accessor)) decoded.missing.push_back(name);
    if (std::ranges::find(decoded.missing, "POSITION") != decoded.missing.end())
        document.fail(element, "its Draco data has no POSITION");
    return decoded;
}

}  // namespace halflight
