// Images of tags in a plain room: rays from a lens table, averaged over the pixel and the exposure, row by row.
// All lengths are in metres; colours are linear until the last step. For ctypes; no state is kept between calls.
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { kWidth = 640, kHeight = 480, kCells = 10, kMostTags = 64, kGrid = 4, kNormals = 4096, kGamma = 4096 };

typedef struct Look {
  double exposure_s, readout_s;  // of each row; from the first row to the last
  double gain;                   // of the camera: 1 brings white paper to 0.8
  double veil;                   // light that the lens spreads over the entire image
  double sharpen;                // fraction of the Laplacian that is added, after gamma
  double shot, read;             // noise: variance = read^2 + shot * signal
  int dark;
} Look;

static uint64_t next_random(uint64_t* state) {
  *state ^= *state << 13, *state ^= *state >> 7, *state ^= *state << 17;
  return *state;
}

static float hash(int x, int y, int z) {
  uint32_t h = (uint32_t)x * 374761393u + (uint32_t)y * 668265263u + (uint32_t)z * 2147483647u;
  h = (h ^ (h >> 13)) * 1274126177u;
  return (float)((h ^ (h >> 16)) & 0xffff) / 65535.f;
}

// Colour of the room in a direction: a plank floor with grain, walls, ceiling. Camera pose: rows of world_R_camera, then origin.
static float room(const double* pose, float x, float y) {
  float d[3];
  for (int i = 0; i < 3; ++i) d[i] = (float)(pose[4 * i] * x + pose[4 * i + 1] * y + pose[4 * i + 2]);
  float nearest = 1e9f;
  int hit = 0;
  const float low[3] = {-6, -5, 0}, high[3] = {6, 5, 2.8f};
  for (int i = 0; i < 3; ++i) {
    if (fabsf(d[i]) < 1e-6f) continue;
    const float t = ((d[i] > 0 ? high[i] : low[i]) - (float)pose[4 * i + 3]) / d[i];
    if (t < nearest) nearest = t, hit = i * 2 + (d[i] > 0);
  }
  const float px = (float)pose[3] + nearest * d[0], py = (float)pose[7] + nearest * d[1], pz = (float)pose[11] + nearest * d[2];
  if (hit == 5) return 0.55f;
  if (hit == 4) {
    const int plank = (int)floorf(py / 0.14f);
    const float grain = hash((int)floorf(px / 0.09f + 7 * hash(plank, 1, 1)), plank, 3);
    return 0.20f + 0.07f * hash(plank, (int)floorf(px / 1.1f), 5) + 0.05f * grain;
  }
  const float along = hit < 2 ? py : px;
  const float skirting = pz < 0.08f ? -0.2f : 0.f;
  const float poster = pz > 1.1f && pz < 1.7f && fmodf(along + 20.f, 1.9f) < 0.6f ? -0.25f : 0.f;
  return 0.42f + skirting + poster + 0.04f * hash((int)floorf(along / 0.3f), (int)floorf(pz / 0.3f), hit);
}

// Homography from a ray (x, y, 1) of the camera to the plane of the tag, in cells from its paper's corner.
static void plane_of(const double* pose, const double* tag, double size, float* out) {
  double m[9];  // columns: tag x, tag y, tag origin, all in the camera
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 2; ++j) m[3 * i + j] = pose[i] * tag[j] + pose[4 + i] * tag[4 + j] + pose[8 + i] * tag[8 + j];
    m[3 * i + 2] = pose[i] * (tag[3] - pose[3]) + pose[4 + i] * (tag[7] - pose[7]) + pose[8 + i] * (tag[11] - pose[11]);
  }
  double a[9];  // adjugate: the scale cancels
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
      a[3 * i + j] = m[3 * r0 + c0] * m[3 * r1 + c1] - m[3 * r0 + c1] * m[3 * r1 + c0];
    }
  const double cells = 8 / size;
  for (int j = 0; j < 3; ++j) {
    out[j] = (float)(cells * a[j] + kCells / 2.0 * a[6 + j]);
    out[3 + j] = (float)(cells * a[3 + j] + kCells / 2.0 * a[6 + j]);
    out[6 + j] = (float)a[6 + j];
  }
}

// Corners of the paper in pixels, plus a margin; nothing if it is behind the camera or seen from behind.
static int box_of(const double* pose, const double* tag, double size, const double* lens, int* box) {
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  double facing = 0;
  for (int i = 0; i < 3; ++i) facing += (tag[4 * i + 3] - pose[4 * i + 3]) * tag[4 * i + 2];
  if (facing <= 0.02) return 0;
  for (int corner = 0; corner < 4; ++corner) {
    const double side = size * kCells / 16, u = (corner & 1) ? side : -side, v = (corner & 2) ? side : -side;
    double p[3] = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
      const double w = tag[4 * i] * u + tag[4 * i + 1] * v + tag[4 * i + 3] - pose[4 * i + 3];
      for (int j = 0; j < 3; ++j) p[j] += pose[4 * i + j] * w;
    }
    if (p[2] < 0.1) return 0;
    const double x = p[0] / p[2], y = p[1] / p[2], r = x * x + y * y;
    if (r > 1.6) return 0;  // far outside the lens's field
    const double stretch = 1 + r * (lens[4] + r * lens[5]);
    const double pixel[2] = {lens[0] * x * stretch + lens[2], lens[1] * y * stretch + lens[3]};
    for (int i = 0; i < 2; ++i) low[i] = fmin(low[i], pixel[i]), high[i] = fmax(high[i], pixel[i]);
  }
  box[0] = (int)fmax(fmin(box[0], low[0] - 3), 0);
  box[1] = (int)fmax(fmin(box[1], low[1] - 3), 0);
  box[2] = (int)fmin(fmax(box[2], high[0] + 4), kWidth - 1);
  box[3] = (int)fmin(fmax(box[3], high[1] + 4), kHeight - 1);
  return box[0] <= box[2] && box[1] <= box[3];
}

static void draw_tag(float* image, const double* poses, int n, const double* tag, double size, const uint8_t* cells, const double* lens,
                     const float* rays, const Look* look, uint64_t* random) {
  int box[4] = {kWidth, kHeight, -1, -1};
  const int seen = box_of(poses, tag, size, lens, box), still = box_of(poses + 12 * (n - 1), tag, size, lens, box);
  if (!seen || !still) return;
  static float planes[1024][9];
  for (int k = 0; k < n; ++k) plane_of(poses + 12 * k, tag, size, planes[k]);
  const double window = look->exposure_s + look->readout_s;
  const int stride = kWidth + 1;
  for (int row = box[1]; row <= box[3]; ++row) {
    const double opens = look->readout_s * row / kHeight;
    for (int column = box[0]; column <= box[2]; ++column) {
      const float *r00 = rays + 2 * (row * stride + column), *r10 = r00 + 2 * stride;
      float light = 0;
      int covered = 0;
      const int turn = (int)(next_random(random) % (kGrid * kGrid));
      for (int s = 0; s < kGrid * kGrid; ++s) {
        const float fx = ((s % kGrid) + 0.5f) / kGrid, fy = ((s / kGrid) + 0.5f) / kGrid;
        const float x = (1 - fy) * ((1 - fx) * r00[0] + fx * r00[2]) + fy * ((1 - fx) * r10[0] + fx * r10[2]);
        const float y = (1 - fy) * ((1 - fx) * r00[1] + fx * r00[3]) + fy * ((1 - fx) * r10[1] + fx * r10[3]);
        const int moment = (7 * s + turn) % (kGrid * kGrid);  // each part of the pixel at a different time
        const double t = opens + look->exposure_s * (moment + 0.5) / (kGrid * kGrid);
        const float* h = planes[(int)(t / window * (n - 1) + 0.5)];
        const float w = 1 / (h[6] * x + h[7] * y + h[8]);
        const float u = (h[0] * x + h[1] * y + h[2]) * w, v = (h[3] * x + h[4] * y + h[5]) * w;
        if (u < 0 || v < 0 || u >= kCells || v >= kCells) continue;
        ++covered;
        light += cells[(int)v * kCells + (int)u] ? 0.80f : 0.045f;
      }
      float* pixel = image + row * kWidth + column;
      *pixel = (light + (kGrid * kGrid - covered) * *pixel) / (kGrid * kGrid);
    }
  }
}

static void blur(float* image, float side) {  // one pass each way of (side, 1 - 2 side, side)
  static float line[kWidth > kHeight ? kWidth : kHeight];
  for (int row = 0; row < kHeight; ++row) {
    float* p = image + row * kWidth;
    memcpy(line, p, sizeof(float) * kWidth);
    for (int i = 1; i < kWidth - 1; ++i) p[i] = (1 - 2 * side) * line[i] + side * (line[i - 1] + line[i + 1]);
  }
  static float above[kWidth], here[kWidth];
  memcpy(above, image, sizeof above);
  for (int row = 1; row < kHeight - 1; ++row) {
    float* p = image + row * kWidth;
    memcpy(here, p, sizeof here);
    for (int i = 0; i < kWidth; ++i) p[i] = (1 - 2 * side) * here[i] + side * (above[i] + p[i + kWidth]);
    memcpy(above, here, sizeof above);
  }
}

// Exposure, noise, gamma, sharpening, eight bits.
static void develop(const float* image, const Look* look, uint64_t* random, uint8_t* out) {
  static float normals[kNormals], gamma_of[kGamma + 1], shown[kWidth * kHeight];
  if (normals[0] == 0 && normals[1] == 0) {
    uint64_t state = 88172645463325252ull;
    for (int i = 0; i < kNormals; ++i) {
      float sum = -6;
      for (int k = 0; k < 12; ++k) sum += (float)(next_random(&state) >> 40) / 16777216.f;
      normals[i] = sum;
    }
    for (int i = 0; i <= kGamma; ++i) gamma_of[i] = 255.f * powf((float)i / kGamma, 1 / 2.2f);
  }
  double mean = 0;
  for (int i = 0; i < kWidth * kHeight; i += 16) mean += image[i];
  mean /= kWidth * kHeight / 16.0;
  const float gain = look->dark ? 0.f : (float)look->gain, veil = (float)(look->veil * mean);
  const float shot = (float)look->shot, read = (float)(look->read * look->read);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const float signal = gain * (image[i] + veil);
    const float noisy = signal + sqrtf(read + shot * signal) * normals[next_random(random) & (kNormals - 1)];
    shown[i] = gamma_of[(int)(kGamma * fminf(1, fmaxf(0, noisy)))];
  }
  const float sharpen = (float)look->sharpen;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const float* p = shown + row * kWidth + column;
      float value = *p;
      if (row > 0 && row < kHeight - 1 && column > 0 && column < kWidth - 1)
        value += sharpen * (4 * value - p[-1] - p[1] - p[-kWidth] - p[kWidth]);
      out[row * kWidth + column] = (uint8_t)(fminf(255, fmaxf(0, value)) + 0.5f);
    }
}

// poses: n times 12 numbers (three rows of world_T_camera), evenly spaced from the opening of the first row to the closing of the last. tags: 12
// numbers each (world_T_tag). rays: (kHeight + 1) x (kWidth + 1) x 2, x / z and y / z of the corners of the pixels.
void render(const double* poses, int n, const double* tags, const double* sizes, const uint8_t* bitmaps, int tag_count, const double* lens,
            const float* rays, const Look* look, uint64_t seed, uint8_t* out) {
  static float image[kWidth * kHeight];
  uint64_t random = seed * 2862933555777941757ull + 3037000493ull;
  const double window = look->exposure_s + look->readout_s;
  for (int row = 0; row < kHeight; row += 2) {
    const double middle = look->readout_s * row / kHeight + look->exposure_s / 2;
    const double* pose = poses + 12 * (int)(middle / window * (n - 1) + 0.5);
    for (int column = 0; column < kWidth; column += 2) {
      const float* ray = rays + 2 * ((row + 1) * (kWidth + 1) + column + 1);
      const float light = room(pose, ray[0], ray[1]);
      float* p = image + row * kWidth + column;
      p[0] = p[1] = p[kWidth] = p[kWidth + 1] = light;
    }
  }
  const double* middle = poses + 12 * (n / 2);
  int order[kMostTags];
  double far[kMostTags];
  if (tag_count > kMostTags) tag_count = kMostTags;
  for (int i = 0; i < tag_count; ++i) {  // the farthest first
    double square = 0;
    for (int k = 0; k < 3; ++k) square += pow(tags[12 * i + 4 * k + 3] - middle[4 * k + 3], 2);
    int place = i;
    for (; place > 0 && far[place - 1] < square; --place) far[place] = far[place - 1], order[place] = order[place - 1];
    far[place] = square, order[place] = i;
  }
  for (int i = 0; i < tag_count; ++i)
    draw_tag(image, poses, n, tags + 12 * order[i], sizes[order[i]], bitmaps + kCells * kCells * order[i], lens, rays, look, &random);
  blur(image, 0.12f);
  develop(image, look, &random, out);
}
