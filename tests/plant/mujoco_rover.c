// A rover in MuJoCo, for ctypes: load, command, read the state. The speed controllers of its motors are part of the rover.
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>

enum { kWheels = 4 };

typedef struct Rover {
  mjModel* model;
  mjData* data;
  int base, spin[kWheels], dof[kWheels], geom[kWheels];
  double friction, loss, integral[kWheels], held_at[2], held_yaw;
  int was_held;
} Rover;

static double yaw_of(const mjtNum* q) { return atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3])); }

Rover* rover_open(const char* xml, double x, double y, double yaw) {
  static const char* joints[kWheels] = {"front_left", "rear_left", "front_right", "rear_right"};
  static const char* geoms[kWheels] = {"g0", "g1", "g2", "g3"};
  char error[500] = "";
  Rover* r = calloc(1, sizeof(Rover));
  r->model = mj_loadXML(xml, NULL, error, sizeof error);
  if (!r->model) {
    fprintf(stderr, "%s: %s\n", xml, error);
    return NULL;
  }
  r->data = mj_makeData(r->model);
  r->base = mj_name2id(r->model, mjOBJ_BODY, "base");
  for (int i = 0; i < kWheels; ++i) {
    const int joint = mj_name2id(r->model, mjOBJ_JOINT, joints[i]);
    r->spin[i] = r->model->jnt_qposadr[joint];
    r->dof[i] = r->model->jnt_dofadr[joint];
    r->geom[i] = mj_name2id(r->model, mjOBJ_GEOM, geoms[i]);
  }
  r->friction = r->model->geom_friction[3 * r->geom[0]];
  r->loss = r->model->dof_frictionloss[r->dof[0]];
  mjtNum* q = r->data->qpos;
  q[0] = x, q[1] = y;
  q[3] = cos(yaw / 2), q[6] = sin(yaw / 2);
  for (int i = 0; i < 400; ++i) mj_step(r->model, r->data);  // it settles on its springs
  q[0] = x, q[1] = y;
  return r;
}

void rover_close(Rover* r) {
  mj_deleteData(r->data);
  mj_deleteModel(r->model);
  free(r);
}

// Torques of a proportional-integral speed controller; a weak battery limits the torques and the maximum speed.
static void drive_wheels(Rover* r, const double* wheel_rad_s, double power, int blocked) {
  const double dt = r->model->opt.timestep;
  for (int i = 0; i < kWheels; ++i) {
    if (blocked) {
      r->data->ctrl[i] = r->integral[i] = 0;  // the motor driver is switched off
      continue;
    }
    const double speed = r->data->qvel[r->dof[i]];
    const double error = wheel_rad_s[i < 2 ? 0 : 1] - speed;
    r->integral[i] = fmax(-0.7, fmin(0.7, r->integral[i] + 0.9 * error * dt));
    const double free_speed = 30 * power;
    const double left = fmax(0, 1 - fabs(speed) / free_speed);
    const double most = 0.9 * power * left;
    r->data->ctrl[i] = fmax(-most, fmin(most, 0.06 * error + r->integral[i]));
  }
}

// A hand that holds the base: a stiff damped spring, horizontally and about the vertical. Without grip, a soft obstacle holds it, and the
// wheels spin.
static void hold(Rover* r, int held, double grip) {
  mjtNum* force = r->data->xfrc_applied + 6 * r->base;
  mju_zero(force, 6);
  const mjtNum *q = r->data->qpos, *v = r->data->qvel;
  if (held && !r->was_held) r->held_at[0] = q[0], r->held_at[1] = q[1], r->held_yaw = yaw_of(q + 3);
  r->was_held = held;
  if (grip < 0.5)
    for (int i = 0; i < 2; ++i) force[i] = -60 * v[i];
  if (!held) return;
  for (int i = 0; i < 2; ++i) force[i] = 8000 * (r->held_at[i] - q[i]) - 300 * v[i];
  const double turn = yaw_of(q + 3) - r->held_yaw;
  force[5] = -100 * atan2(sin(turn), cos(turn)) - 4 * v[5];
}

void rover_advance(Rover* r, double dt, double left_rad_s, double right_rad_s, double power, double grip, int held, int blocked) {
  const double wheels[2] = {left_rad_s, right_rad_s};
  const int steps = (int)(dt / r->model->opt.timestep + 0.5);
  for (int i = 0; i < kWheels; ++i) {
    r->model->geom_friction[3 * r->geom[i]] = r->friction * grip;
    r->model->dof_frictionloss[r->dof[i]] = blocked ? 8 : r->loss;
  }
  const int floor = mj_name2id(r->model, mjOBJ_GEOM, "floor");
  r->model->geom_friction[3 * floor] = r->friction * grip;  // MuJoCo takes the larger of two
  for (int step = 0; step < steps; ++step) {
    drive_wheels(r, wheels, power, blocked);
    hold(r, held, grip);
    mj_step(r->model, r->data);
  }
}

// x, y, z, roll, pitch, yaw of the point on the floor below the base, speed along x, yaw rate, left and right wheels' mean angle.
void rover_motion(const Rover* r, double height, double* out) {
  const mjtNum *q = r->data->qpos, *v = r->data->qvel;
  mjtNum matrix[9];
  mju_quat2Mat(matrix, q + 3);
  for (int i = 0; i < 3; ++i) out[i] = q[i] - matrix[3 * i + 2] * height;
  out[3] = atan2(matrix[7], matrix[8]);
  out[4] = asin(fmax(-1, fmin(1, -matrix[6])));
  out[5] = atan2(matrix[3], matrix[0]);
  out[6] = v[0] * matrix[0] + v[1] * matrix[3];
  out[7] = v[5];
  out[8] = (q[r->spin[0]] + q[r->spin[1]]) / 2;
  out[9] = (q[r->spin[2]] + q[r->spin[3]]) / 2;
}
