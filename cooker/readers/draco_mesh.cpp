// SPDX-License-Identifier: MIT
#include "readers/draco_mesh.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

#include <algorithm>

namespace rill::cooker {
namespace {

int add_vectors(draco::Mesh& mesh, const std::vector<glm::vec3>& values, draco::GeometryAttribute::Type type) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, 3, draco::DT_FLOAT32, false, sizeof(glm::vec3), 0);
    const int id = mesh.AddAttribute(attribute, true, uint32_t(values.size()));
    for (uint32_t i = 0; i < values.size(); ++i) mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
    return id;
}

std::vector<glm::vec3> get_vectors(const draco::Mesh& mesh, const draco::PointAttribute& attribute, const std::string& name) {
    std::vector<glm::vec3> values(mesh.num_points());
    for (uint32_t i = 0; i < values.size(); ++i) {
        const draco::AttributeValueIndex at = attribute.mapped_index(draco::PointIndex(i));
        if (at.value() >= attribute.size()) throw InputError(name + ": damaged Draco mesh: point " + std::to_string(i) + " has no value");
        attribute.ConvertValue<float, 3>(at, &values[i].x);
    }
    return values;
}

/// The largest of the counts that Draco makes room for before it has read what they count; 0 where it will refuse the file.
uint32_t largest_count(const std::string& bytes) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::DracoHeader header;
    if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok() || header.encoder_type != draco::TRIANGULAR_MESH) return 0;
    buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor));
    draco::GeometryMetadata metadata;
    const bool has_metadata = buffer.bitstream_version() >= 0x103 && (header.flags & METADATA_FLAG_MASK);
    if (has_metadata && !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) return 0;
    const bool edgebreaker = header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING;
    constexpr uint16_t version_2_0 = 0x200, version_2_2 = 0x202;
    const uint16_t version = buffer.bitstream_version();
    uint8_t traversal;
    if (edgebreaker && !buffer.Decode(&traversal)) return 0;
    uint32_t largest = 0;
    const bool fixed = version < (edgebreaker ? version_2_0 : version_2_2);  // four bytes each
    for (int counts = edgebreaker && version < version_2_2 ? 3 : 2; counts > 0; --counts) {
        uint32_t count;
        if (!(fixed ? buffer.Decode(&count) : draco::DecodeVarint(&count, &buffer))) return 0;
        largest = std::max(largest, count);
    }
    return largest;
}

/// Far more faces than Draco's best codes can describe in so many bytes.
uint64_t most_faces_in(size_t bytes) { return 65536 + 1024 * uint64_t(bytes); }

std::unique_ptr<draco::Mesh> decode_any(const std::string& bytes, const std::string& name) {
    try {
        if (const uint32_t count = largest_count(bytes); count > most_faces_in(bytes.size()))
            throw InputError(name + ": damaged Draco mesh: states " + std::to_string(count) + " faces or vertices in " +
                             std::to_string(bytes.size()) + " bytes");
        draco::DecoderBuffer buffer;
        buffer.Init(bytes.data(), bytes.size());
        draco::Decoder decoder;
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok()) throw InputError(name + ": not a Draco mesh: " + decoded.status().error_msg());
        return std::move(decoded).value();
    } catch (const std::bad_alloc&) {  // Draco believes the counts that a damaged file states
        throw InputError(name + ": damaged Draco mesh: states more than fits in memory");
    } catch (const std::length_error&) {
        throw InputError(name + ": damaged Draco mesh: states more than fits in memory");
    }
}

}  // namespace

std::string draco_encode(const Mesh& mesh, int bits, int velocity_bits) {
    if (mesh.triangles.empty()) return {};
    draco::Mesh target;
    target.set_num_points(uint32_t(mesh.positions.size()));
    target.SetNumFaces(mesh.triangles.size());
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        target.SetFace(draco::FaceIndex(i), {draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
    }
    add_vectors(target, mesh.positions, draco::GeometryAttribute::POSITION);
    if (!mesh.velocities.empty()) add_vectors(target, mesh.velocities, draco::GeometryAttribute::GENERIC);
    draco::Encoder encoder;
    encoder.SetSpeedOptions(0, 0);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::GENERIC, velocity_bits);
    draco::EncoderBuffer buffer;
    if (const draco::Status status = encoder.EncodeMeshToBuffer(target, &buffer); !status.ok())
        throw InputError(std::string("Draco cannot encode this mesh: ") + status.error_msg());
    return std::string(buffer.data(), buffer.size());
}

Mesh draco_decode(const std::string& bytes, const std::string& name, const DracoIds& ids) {
    Mesh mesh;
    if (bytes.empty()) return mesh;
    const std::unique_ptr<draco::Mesh> source = decode_any(bytes, name);
    const auto find = [&](int id, draco::GeometryAttribute::Type type) {
        if (id >= 0) return source->GetAttributeByUniqueId(uint32_t(id));
        return ids.position >= 0 ? nullptr : source->GetNamedAttribute(type);
    };
    const draco::PointAttribute* position = find(ids.position, draco::GeometryAttribute::POSITION);
    if (!position || position->num_components() != 3) throw InputError(name + ": no positions of three components in its Draco mesh");
    mesh.positions = get_vectors(*source, *position, name);
    const draco::PointAttribute* velocity = find(ids.velocity, draco::GeometryAttribute::GENERIC);
    if (velocity && velocity->num_components() == 3 && velocity->data_type() == draco::DT_FLOAT32)
        mesh.velocities = get_vectors(*source, *velocity, name);
    mesh.triangles.resize(source->num_faces());
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) mesh.triangles[i][k] = source->face(draco::FaceIndex(i))[k].value();
    return mesh;
}

}  // namespace rill::cooker
