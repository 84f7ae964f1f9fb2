#pragma once

#include "core/scene/byte_stream.h"
#include "core/scene/scene.h"

// The pieces of format "BWSC" (schema/scene.md) that serialisation and canonical order share.
namespace bakewell {

void PutTexture(ByteWriter& writer, const Texture& texture);
// Without the name.
void PutMaterial(ByteWriter& writer, const Material& material);
// Without material, name and source.
void PutGeometry(ByteWriter& writer, const Object& object);
// Without the name.
void PutLight(ByteWriter& writer, const PunctualLight& light);
// Everything a bake depends on, from the magic number on.
void PutContent(ByteWriter& writer, const Scene& scene);

}  // namespace bakewell
