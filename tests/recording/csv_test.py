"""Tables with named columns, compared with Python's csv module."""
import csv
import gzip
import unittest

import dumps


def rows(path):
    with gzip.open(path, "rt") as table:
        return list(csv.DictReader(table))


class Tables(dumps.InFolder):
    def table(self, content, name="table"):
        path = self.folder / name
        path.write_text(content)
        return path

    def test_units_orders_and_stamps(self):
        log = dumps.Log(self.table("t_ns,cam,tag,x0,y0,x1,y1,x2,y2,x3,y3,hamming\n"
                                   "1000,left,7,10,40,30,40,30,20,10,20,1\n1000,left,8,0,1,1,1,1,0,0,0,0\n"
                                   "1000,right,7,0,1,1,1,1,0,0,0,0\n"), "--samples")
        self.assertEqual(log.samples[0], ["tags", "1000", "left", "2",
                                          "tag36h11:7:1,10.500,20.500,30.500,20.500,30.500,40.500,10.500,40.500",
                                          "tag36h11:8:0,0.500,0.500,1.500,0.500,1.500,1.500,0.500,1.500"])
        self.assertEqual(log.samples[1][2:4], ["right", "1"])
        self.assertEqual(log.problems["csv.tag_corners"].count, 3)
        log = dumps.Log(self.table("t_s,landmark,range_m,bearing_rad\r\n1609357294.418400841,9,1.5,-0.5\r\n"), "--samples")
        self.assertEqual(log.samples, [["range_bearing", "1609357294418400841", "9 1.5000000 -0.5000000"]])
        log = dumps.Log(self.table("# made by hand\n"), "--samples")
        self.assertEqual(log.code, 1)

    def test_speeds_are_integrated_over_the_preceding_interval(self):
        log = dumps.Log(self.table("t_s,v_m_s,omega_rad_s\n0,5,0\n1,1,0\n2,1,0\n"), "--samples")
        self.assertEqual(log.samples[-1][2], "2.0000000 0.0000000 0.0000000 1.0000000 0.0000000")
        self.assertEqual(log.problems["csv.integrated"].count, 3)

    def test_invalid_rows_are_skipped_and_reported(self):
        log = dumps.Log(self.table("t_s,landmark,range_m,bearing_rad\n1,2,3,4\nx,2,3,4\n2,2,nan,4\n3,2\n4,2,3,4\n0,2,3,4\n5,2,"),
                        "--samples")
        self.assertEqual([s[1] for s in log.samples], ["1000000000", "4000000000", "0"])
        damage = [p for p in log.words.splitlines() if "csv.row" in p]
        self.assertTrue(any(":3" in p for p in damage), damage)
        self.assertEqual(log.problems["csv.time_back"].count, 1)

    def test_unknown_columns_are_errors(self):
        log = dumps.Log(self.table("t_s,range,bearing\n1,2,3\n"))
        self.assertEqual(log.code, 1)
        self.assertIn("landmark,range_m,bearing_rad", log.words)
        self.assertIn("t_ns", dumps.Log(self.table("a,b\n1,2\n")).words)
        duplicate = dumps.Log(self.table("t_s,a,a\n1,2,3\n"))
        self.assertEqual(duplicate.code, 1)
        self.assertRegex(duplicate.words, "duplicate.* 'a'")

    def test_real_robot(self):
        folder = dumps.real_data("aer1513")
        measured = rows(folder / "measurements.csv.gz")
        log = dumps.Log(folder / "measurements.csv.gz", "--samples")
        self.assertEqual(len(log.samples), len(measured))
        self.assertEqual(len(measured), 61_086)
        for ours, row in zip(log.samples, measured):
            landmark, distance, bearing = ours[2].split()
            self.assertEqual((int(ours[1]), landmark), (round(float(row["t_s"]) * 1e9), row["landmark"]))
            self.assertEqual((float(distance), float(bearing)), (float(row["range_m"]), float(row["bearing_rad"])))
        odometry = dumps.Log(folder / "odometry.csv.gz", "--samples")
        self.assertEqual(len(odometry.samples), len(rows(folder / "odometry.csv.gz")))
        truth, true_rows = dumps.Log(folder / "truth.csv.gz", "--samples"), rows(folder / "truth.csv.gz")
        self.assertEqual(len(truth.samples), sum(r["valid"] == "1" for r in true_rows))
        self.assertEqual(truth.problems["csv.truth_not_valid"].count, sum(r["valid"] == "0" for r in true_rows))
        print(f"{len(measured)} ranges, {len(odometry.samples)} of odometry, {len(truth.samples)} ground truth poses")

    def test_all_real_detection_tables(self):
        count = 0
        for path in sorted(dumps.real_data("tagslam").glob("test_*/detections.csv.gz")):
            table = rows(path)
            log = dumps.Log(path, "--samples")
            self.assertEqual(sum(int(s[3]) for s in log.samples), len(table), path)
            self.assertEqual(len(log.samples), len({(r["t_ns"], r["cam"]) for r in table}), path)
            self.assertNotIn("csv.row", log.problems)
            count += len(table)
        for path in sorted(dumps.real_data("tagslam").glob("test_*/odometry.csv.gz")):
            self.assertEqual(len(dumps.Log(path, "--samples").samples), len(rows(path)), path)
        print(f"{count} detections")


if __name__ == "__main__":
    dumps.main()
