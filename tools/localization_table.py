#!/usr/bin/python3
"""Localises on two recordings of others and writes the table of docs/results.md.

usage: tools/localization_table.py PROGRAM DATA [--write docs/results.md]

DATA holds lcm/ (an MBot driving three times round a taped rectangle) and aer1513/ (University of Toronto). Without --write the
table is printed.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

LAP_1_S = 60  # the first of three laps: what the calibration may see
TAPE = "x_m,y_m\n0,0\n1.32,0\n1.32,1.04\n0,1.04\n"
MBOT = "--tag-sigma-m 0.01 --point-sigma-m 0.01 --mounting-sigma-m 0.005 --mounting-sigma-rad 0.005".split()
AER = ("--sensor-pose 0.219016 0 0 --tag-sigma-m 0.02 --mounting-sigma-rad 0.02 --camera-latency-s 0.05 --along-m-sqrt-m 0.04 "
       "--across-m-sqrt-m 0.04 --yaw-rad-sqrt-m 0.03 --yaw-rad-sqrt-rad 0.05 --yaw-rad-sqrt-s 0.02 --drift-m-sqrt-s 0.005 "
       "--certain-sigma-m 10").split()
BEGIN, END = "<!-- localization table -->\n", "<!-- end of localization table -->\n"


def run(program, folder, *words):
    done = subprocess.run([program, *map(str, words), "--json"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"waymark {' '.join(map(str, words))}:\n{done.stderr}")
    return json.loads(done.stdout), done.stderr


def metres(value):
    return "-" if value is None else f"{value:.4f}"


def mbot(program, folder, data):
    log, landmarks = data / "lcm/lcmlog-2024-04-15.00", data / "lcm/landmarks.csv"
    (folder / "tape.csv").write_text(TAPE)
    run(program, folder, "calibrate", "robot", log, "--map", landmarks, "--to", LAP_1_S, "-o", "calibration.yaml", *MBOT)
    rows = []
    for name, flags in (("riekf, not calibrated", []), ("riekf, calibrated on lap 1", ["--calibration", "calibration.yaml"])):
        output = f"mbot{len(rows)}.mcap"
        report, words = run(program, folder, "localize", log, "--map", landmarks, "-o", output, *flags, *MBOT)
        judge = ["evaluate", output, "tape.csv", "--closed", "--odometry", log]
        later, _ = run(program, folder, *judge, "--from", LAP_1_S)
        first, _ = run(program, folder, *judge, "--to", LAP_1_S)
        rows.append((name, later, first, report))
    last_later, last_first = rows[-1][1], rows[-1][2]
    lines = ["| MBot, from the tape, m | laps 2 and 3, RMS | worst | lap 1, signed, RMS |", "|---|---|---|---|"]
    for beside in last_later["beside"]:
        lap1 = next(row for row in last_first["beside"] if row["name"] == beside["name"])
        lines.append(f"| {beside['name']} | {metres(beside['path_rmse_m'])} | {metres(beside['path_max_m'])} | {metres(lap1['side_rmse_m'])} |")
    for name, later, first, _ in rows:
        lines.append(f"| {name} | {metres(later['path_rmse_m'])} | {metres(later['path_max_m'])} | {metres(first['side_rmse_m'])} |")
    said = [line.split(": ", 1)[1] for line in words.splitlines() if "swapped" in line]
    return lines + ["", f"Said of the map: {'; '.join(said) or 'nothing'}."]


def aer1513(program, folder, data):
    where = data / "aer1513"
    lines = ["| AER1513 | position RMSE, m | worst, m | yaw RMSE, deg | NEES (3) | odometry alone, m |", "|---|---|---|---|---|---|"]
    for farthest in (5, 3, 1):
        output = f"aer{farthest}.mcap"
        run(program, folder, "localize", where / "measurements.csv.gz", where / "odometry.csv.gz", "--map", where / "landmarks.csv",
            "--farthest-m", farthest, "-o", output, *AER)
        scores, _ = run(program, folder, "evaluate", output, where / "truth.csv.gz", "--odometry", where / "odometry.csv.gz")
        lines.append(f"| landmarks within {farthest} m | {metres(scores['ate_rmse_m'])} | {metres(scores['ate_max_m'])} | "
                     f"{scores['heading_rmse_deg']:.2f} | {scores['nees_mean']:.2f} | {metres(scores['beside'][0]['ate_rmse_m'])} |")
    return lines


def main():
    if len(sys.argv) not in (3, 5):
        sys.exit(__doc__)
    program, data = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory(prefix="waymark-localization-") as name:
        folder = pathlib.Path(name)
        table = "\n".join([*mbot(program, folder, data), "", *aer1513(program, folder, data)]) + "\n"
    if len(sys.argv) == 3:
        print(table, end="")
        return
    page = pathlib.Path(sys.argv[4])
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(before + BEGIN + table + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
