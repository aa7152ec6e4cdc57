#pragma once

#include <cstdint>
#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// A detector implemented by libapriltag 3.3. Errors: a value out of range or an unknown family
/// (InvalidArgument), tables beyond memory_limit_mib (LimitExceeded). Creation takes milliseconds for
/// tag36h11 and up to a second for the largest families.
///
/// detect() works in place on images of any stride, unless quad_sigma requires a copy. It needs about 12
/// bytes of memory per pixel, and up to 60 for an image of noise; images beyond kMaxImagePixels are rejected.
/// Thread-safe: each concurrent call uses a separate workspace, which is kept for later calls.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_apriltag_detector(const DetectorOptions& options = {});

/// Size of the decoding table of one family with `max_hamming` corrected bits (0 to 2), in bytes: the table
/// contains every code with every pattern of wrong bits.
[[nodiscard]] std::int64_t decode_table_bytes(const Family& family, int max_hamming);

}  // namespace waymark
