"""Recordings as pandas DataFrames, one per sample type. Needs pandas."""


def _rows_of(sample):
    """Yields (table, row) for a sample; a camera frame has one row per tag."""
    from . import samples

    stamp = {"stamp_ns": sample.stamp_ns}
    if isinstance(sample, samples.Odometry):
        at = sample.odom_T_base
        yield "odometry", stamp | {"x_m": at.x, "y_m": at.y, "yaw_rad": at.yaw, "speed_m_s": sample.speed_m_s,
                                   "yaw_rate_rad_s": sample.yaw_rate_rad_s}
    elif isinstance(sample, samples.WheelTicks):
        yield "wheels", stamp | {"left_rad": sample.left_rad, "right_rad": sample.right_rad}
    elif isinstance(sample, samples.ImuSample):
        rate, force = sample.angular_velocity_rad_s, sample.linear_acceleration_m_s2
        yield "imu", stamp | {f"{name}_rad_s": rate[i] for i, name in enumerate(("roll_rate", "pitch_rate", "yaw_rate"))} | \
            {f"{name}_m_s2": force[i] for i, name in enumerate(("ax", "ay", "az"))}
    elif isinstance(sample, samples.StampedCommand):
        yield "commands", stamp | {"speed_m_s": sample.speed_m_s, "yaw_rate_rad_s": sample.yaw_rate_rad_s}
    elif isinstance(sample, samples.TruthPose):
        at = sample.map_T_base.project_to_plane()
        yield "truth", stamp | {"x_m": at.x, "y_m": at.y, "yaw_rad": at.yaw}
    elif isinstance(sample, samples.TagFrame):
        for detection in sample.detections:
            corners = {f"{axis}{i}_px": detection.corners_px[i, k] for i in range(4) for k, axis in enumerate("xy")}
            yield "tags", stamp | {"camera": sample.camera, "tag": detection.tag, "hamming": detection.hamming,
                                   "decision_margin": detection.decision_margin} | corners
    elif isinstance(sample, samples.RangeBearing):
        yield "range_bearing", stamp | {"landmark": sample.landmark, "range_m": sample.range_m, "bearing_rad": sample.bearing_rad}


def read(path, topics=None, from_ns=None, to_ns=None):
    """Reads a recording in any format into a dictionary of DataFrames: odometry, wheels, imu, commands, truth, tags,
    range_bearing; column names include the units, and stamp_ns is the measurement time. Images and scans have no table."""
    import pandas

    from . import recording

    tables = {}
    for sample in recording.Recording(path).samples(topics, from_ns, to_ns):
        for name, row in _rows_of(sample):
            tables.setdefault(name, []).append(row)
    return {name: pandas.DataFrame(rows) for name, rows in tables.items()}
