#include "core/wire/control_message.hpp"

namespace rig {

namespace {

constexpr std::uint8_t kNeutralBit = 1U << 0;

void write_edit(const ControlEdit& edit, ByteWriter& writer) {
    writer.write(edit.kind);
    writer.write(std::uint8_t{0});
    writer.write(edit.first);
    writer.write(edit.second);
    writer.write(std::uint16_t{0});
    writer.write(edit.value);
    writer.write(edit.high);
    writer.write(edit.shapes);
}

// False when a reserved byte is set or the edit cannot be.
bool read_edit(ByteReader& reader, ControlEdit& edit) {
    edit.kind = reader.read<ControlKind>();
    const auto reserved = reader.read<std::uint8_t>();
    edit.first = reader.read<std::uint16_t>();
    edit.second = reader.read<std::uint16_t>();
    const auto reserved_too = reader.read<std::uint16_t>();
    edit.value = reader.read<float>();
    edit.high = reader.read<float>();
    edit.shapes = reader.read<ShapeMask>();
    return reserved == 0 && reserved_too == 0 && is_valid(edit);
}

}  // namespace

Result<std::size_t, WireError> encode(const ControlMessage& message, MutableByteSpan into) {
    ByteWriter writer(into);
    writer.write(kControlLayout);
    writer.write(static_cast<std::uint8_t>(message.neutral_first ? kNeutralBit : 0U));
    writer.write(static_cast<std::uint8_t>(message.edits.size()));
    writer.write(std::uint8_t{0});
    for (const ControlEdit& edit : message.edits) {
        if (!is_valid(edit)) return failure(WireError::kRange);
        write_edit(edit, writer);
    }
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

Result<ControlMessage, WireError> decode_control(ByteSpan payload) {
    ByteReader reader(payload);
    const auto layout = reader.read<std::uint8_t>();
    const auto flags = reader.read<std::uint8_t>();
    const auto count = reader.read<std::uint8_t>();
    const auto reserved = reader.read<std::uint8_t>();
    if (!reader.ok()) return failure(WireError::kLength);
    if (layout != kControlLayout) return failure(WireError::kVersion);
    if (flags > kNeutralBit || reserved != 0 || count > kMaxControlEdits) return failure(WireError::kRange);
    if (reader.remaining() != count * kControlEditBytes) return failure(WireError::kLength);
    ControlMessage message;
    message.neutral_first = flags == kNeutralBit;
    message.edits.resize(count);
    for (ControlEdit& edit : message.edits) {
        if (!read_edit(reader, edit)) return failure(WireError::kRange);
    }
    return message;
}

}  // namespace rig
