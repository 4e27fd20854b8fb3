#include <fmt/format.h>

#include "core/base/files.h"
#include "core/mesh/render.h"

// Static, so that another library's copy of the same functions does no harm.
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

namespace stance {

absl::Status WritePng(const Image& image, const std::filesystem::path& path) {
  if (image.width <= 0 || image.height <= 0) {
    return absl::InvalidArgumentError(
        fmt::format("{}: an image of {} x {} pixels has no PNG", path.string(), image.width, image.height));
  }
  std::string bytes;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<size_t>(size));
  };
  if (stbi_write_png_to_func(append, &bytes, image.width, image.height, 3, image.rgb.data(),
                             image.width * 3) == 0) {
    return absl::ResourceExhaustedError(fmt::format("{}: no memory to compress the image", path.string()));
  }
  return WriteFile(path, bytes);
}

}  // namespace stance
