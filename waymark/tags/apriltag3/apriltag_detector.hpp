#pragma once

#include <cstdint>
#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// A detector with libapriltag 3.3 behind it. Errors: a value out of range or an unknown family
/// (InvalidArgument), tables beyond memory_limit_mib (LimitExceeded). Takes milliseconds for tag36h11, up to
/// a second for the largest families.
///
/// detect() works on the image where it lies, with any stride, unless quad_sigma needs a copy. Memory of its
/// own is about 12 bytes a pixel, and up to 60 in an image of noise; images beyond kMaxImagePixels are
/// refused. Several threads may call it at once: each gets a workspace of its own, kept for later calls.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_apriltag_detector(const DetectorOptions& options = {});

/// Size of the table that decodes one family with `max_hamming` corrected bits (0 to 2), in bytes: it lists
/// every code with every pattern of wrong bits.
[[nodiscard]] std::int64_t decode_table_bytes(const Family& family, int max_hamming);

}  // namespace waymark
