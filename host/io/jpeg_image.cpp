// SPDX-License-Identifier: Apache-2.0
#include "host/io/jpeg_image.h"

// jpeglib.h needs the declarations of these two before it.
#include <cstddef>
#include <cstdio>

#include <jpeglib.h>

#include <csetjmp>

#include "common/error.h"

namespace mf {

namespace {

// libjpeg leaves through longjmp, which skips destructors: between setjmp and libjpeg nothing is owned. A warning is
// damaged data (the decoder makes up what is missing), so it counts as an error.
struct JpegError {
  jpeg_error_mgr manager{};  // first: libjpeg hands back a pointer to it
  std::jmp_buf back{};
  char message[JMSG_LENGTH_MAX] = "";
};

[[noreturn]] void jump_with_error(j_common_ptr info) {
  auto* error = reinterpret_cast<JpegError*>(info->err);
  info->err->format_message(info, error->message);
  std::longjmp(error->back, 1);
}

void jump_at_warning(j_common_ptr info, int level) {
  if (level < 0) jump_with_error(info);
}

class JpegReader {
 public:
  explicit JpegReader(JpegError& error) {
    info_.err = jpeg_std_error(&error.manager);
    error.manager.error_exit = jump_with_error;
    error.manager.emit_message = jump_at_warning;
    jpeg_create_decompress(&info_);
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
  ~JpegReader() { jpeg_destroy_decompress(&info_); }

  [[nodiscard]] jpeg_decompress_struct& info() { return info_; }

 private:
  jpeg_decompress_struct info_{};
};

bool read_header(jpeg_decompress_struct& info, JpegError& error, std::string_view bytes) {
  if (setjmp(error.back) != 0) return false;
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&info, TRUE);
  info.out_color_space = JCS_RGB;
  jpeg_start_decompress(&info);
  return true;
}

bool read_rows(jpeg_decompress_struct& info, JpegError& error, ImageU8& image) {
  if (setjmp(error.back) != 0) return false;
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = image.row(static_cast<int>(info.output_scanline)).data();
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

}  // namespace

ImageU8 decode_jpeg(std::string_view bytes, const std::string& file) {
  JpegError error;
  JpegReader reader(error);
  const auto fail = [&] {
    throw InputError(file, "", "is damaged (" + std::string(error.message) + "): copy it again");
  };
  if (!read_header(reader.info(), error, bytes)) fail();
  ImageU8 image(static_cast<int>(reader.info().output_width), static_cast<int>(reader.info().output_height), 3);
  if (!read_rows(reader.info(), error, image)) fail();
  return image;
}

}  // namespace mf
