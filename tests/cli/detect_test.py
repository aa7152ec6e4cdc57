#!/usr/bin/python3
"""`waymark detect` on the command line: readable images, unreadable images, annotated images.

usage: detect_test.py PROGRAM [unittest options]
"""
import gzip
import os
import shutil
import unittest
import zlib

import images
from harness import TAG_FAR, InFolder
import golden_page


class Detect(InFolder):
    def test_json_has_the_documented_keys(self):
        outcome = self.run_here("detect", "--json", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        (record,) = outcome.records
        self.assertEqual((record["image"], record["width_px"], record["height_px"]), ("photograph.png", 320, 240))
        self.assert_tags(record, images.SCENE_TAGS)
        first = record["detections"][0]
        self.assertEqual((first["family"], first["id"], first["hamming"]), ("tag36h11", 7, 0))
        self.assertLess(abs(first["center_px"][0] - 64) + abs(first["center_px"][1] - 74), TAG_FAR)
        self.assertGreater(first["decision_margin"], 10)

    def test_refined_corners_have_an_uncertainty(self):
        refined = self.run_here("detect", "--json", "--covariance", "photograph.png").records[0]["detections"][0]
        self.assertEqual(refined["refinement"], "refined")
        self.assertTrue(all(0 < s < 1 for corner in refined["corner_sigma_px"] for s in corner))
        covariance = refined["corner_covariance_px2"]
        self.assertEqual([len(row) for row in covariance], [8] * 8)
        self.assertEqual(covariance, [list(column) for column in zip(*covariance)])
        self.assertAlmostEqual(covariance[0][0] ** 0.5, refined["corner_sigma_px"][0][0], places=6)
        found = self.run_here("detect", "--json", "--covariance", "--no-refine", "photograph.png").records[0]["detections"][0]
        self.assertFalse({"refinement", "corner_sigma_px", "corner_covariance_px2"} & found.keys())
        self.assertNotEqual(found["corners_px"], refined["corners_px"])

    def test_the_table_lists_every_image_and_tag(self):
        outcome = self.run_here("detect", "photos")
        self.assertEqual(outcome.code, 0)
        for part in (r"photos/0001\.png: 2 .* 320 x 240 px", "tag36h11:42", r"photos/0003\.ppm: 0 "):
            self.assertRegex(outcome.out, part)
        self.assertRegex(outcome.err, r": 3 \w+, 3 \w+, 0 \w+\n")

    def test_same_input_same_bytes(self):
        first = self.run_here("detect", "--json", "--covariance", "photos")
        self.assertEqual(first.out, self.run_here("detect", "--json", "--covariance", "photos").out)

    def test_formats(self):
        rows = images.scene(320, 240, images.SCENE_TAGS)
        images.write_pgm16(self.folder / "deep.pgm", rows)
        images.write_png(self.folder / "deep.png", rows, depth=16)
        images.write_ppm(self.folder / "colour.ppm", rows)
        (self.folder / "cmyk.jpg").write_bytes(images.CMYK_JPEG)
        outcome = self.run_here("detect", "--json", "deep.pgm", "deep.png", "colour.ppm", "cmyk.jpg")
        self.assertEqual(outcome.code, 0, outcome.err)
        for record in outcome.records[:3]:
            self.assert_tags(record, images.SCENE_TAGS)
        self.assertEqual((outcome.records[3]["width_px"], outcome.records[3]["detections"]), (64, []))

    def test_annotated_images_are_written_as_a_readable_video(self):
        outcome = self.run_here("detect", "photograph.png", "--annotate", "walk.mp4")
        self.assertEqual(outcome.code, 0, outcome.err)
        seen = self.run_here("detect", "--json", "walk.mp4")
        self.assertEqual(seen.code, 0, seen.err)
        (record,) = seen.records
        self.assertEqual((record["image"], record["stamp_s"]), ("walk.mp4#0.000000000", 0))
        self.assertEqual((record["width_px"], record["height_px"]), (320, 240))
        converted = self.run_here("convert", "walk.mp4", "walk.mcap", "--record-images", "jpeg")
        self.assertEqual(converted.code, 0, converted.err)
        self.assertRegex(converted.out, r"walk\.mcap: 1 \w+, 2 ")
        before = (self.folder / "walk.mcap").read_bytes()
        again = self.run_here("convert", "walk.mp4", "walk.mcap")
        self.assertEqual(again.code, 1)
        self.assertIn("walk.mcap: ", again.err)
        self.assertEqual((self.folder / "walk.mcap").read_bytes(), before)

    def test_mapping_a_video_requires_its_camera(self):
        self.run_here("detect", "photograph.png", "--annotate", "walk.mp4")
        (self.folder / "camera.yaml").write_text(images.CAMERA)
        for flags, words in (([], "--camera"), (["--camera", "camera.yaml"], "--tag-size-m"),
                             (["--camera", "camera.yaml", "--tag-size-m", "0.16", "--robot", "limo"], "`waymark map lap`")):
            outcome = self.run_here("map", "walk.mp4", "-o", "map", *flags)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn(words, outcome.err)

    def test_smallest_and_widest(self):
        images.write_pgm(self.folder / "one.pgm", [bytes([7])])
        far = [("tag36h11", 7, 19900, 20, 8)]
        images.write_pgm(self.folder / "wide.pgm", images.scene(20000, 110, far))
        outcome = self.run_here("detect", "--json", "--annotate", "seen", "one.pgm", "wide.pgm")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(outcome.records[0]["detections"], [])
        self.assert_tags(outcome.records[1], far)

    def test_other_families(self):
        tags = [("tag16h5", 3, 40, 40, 10)]
        images.write_png(self.folder / "small.png", images.scene(200, 160, tags))
        outcome = self.run_here("detect", "--json", "--family", "16h5", "--family", "tag36h11", "small.png", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assert_tags(outcome.records[0], tags)
        self.assertIn("tag36h11:42", [d["tag"] for d in outcome.records[1]["detections"]])
        none = self.run_here("detect", "--json", "--family", "tag25h9", "photograph.png")
        self.assertEqual((none.code, none.records[0]["detections"]), (0, []))

    def test_patterns_and_folders(self):
        (self.folder / "photos/inner").mkdir()
        shutil.copy(self.folder / "photograph.png", self.folder / "photos/inner/deep.png")
        names = [r["image"] for r in self.run_here("detect", "--json", "photos/*.p?m").records]
        self.assertEqual(names, ["photos/0002.pgm", "photos/0003.ppm"])
        self.assertEqual(len(self.run_here("detect", "--json", "photos").records), 3)
        self.assertEqual(len(self.run_here("detect", "--json", "--recursive", "photos").records), 4)


class Annotate(InFolder):
    def test_every_image_is_annotated_once_and_in_colour(self):
        for side in ("left", "right"):
            (self.folder / side).mkdir()
            shutil.copy(self.folder / "photograph.png", self.folder / side / "0001.png")
        outcome = self.run_here("detect", "--annotate", "out/seen", "left", "right", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        names = sorted(p.name for p in (self.folder / "out/seen").iterdir())
        self.assertEqual(names, ["left__0001.png.png", "photograph.png", "right__0001.png.png"])
        data = (self.folder / "out/seen/photograph.png").read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual((int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"), data[25]), (320, 240, 2))

    def test_results_are_printed_if_the_folder_cannot_be_created(self):
        (self.folder / "file").write_text("in the way")
        outcome = self.run_here("detect", "--json", "--annotate", "file/seen", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertEqual(len(outcome.records), 3)
        self.assertIn("file/seen: ", outcome.err)

    def test_an_unwritable_image_does_not_affect_the_others(self):
        (self.folder / "seen/0001.png").mkdir(parents=True)  # a folder where the file should go
        outcome = self.run_here("detect", "--json", "--annotate", "seen", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertEqual([r.get("error", {}).get("code") for r in outcome.records], ["unwritable", None, None])
        self.assertEqual(len(outcome.records[0]["detections"]), 2)
        self.assertTrue((self.folder / "seen/0002.png").exists())

    def test_input_images_are_not_overwritten(self):
        before = (self.folder / "photograph.png").read_bytes()
        for folder, source in ((".", "photograph.png"), ("photos/../photos", "photos")):
            outcome = self.run_here("detect", "--annotate", folder, source)
            self.assertEqual(outcome.code, 2)
            self.assertIn(f"({folder}): ", outcome.err)
            golden_page.expect(self, "detect", outcome.err)
        self.assertEqual((self.folder / "photograph.png").read_bytes(), before)


class BadInput(InFolder):
    """Each error has its code and place, and the readable image after it is processed."""

    def check(self, source, code, *parts):
        outcome = self.run_here("detect", "--json", source, "photograph.png")
        self.assertEqual(outcome.code, 1, outcome.err)
        failed, good = outcome.records
        self.assertEqual(failed["error"]["code"], code)
        self.assertNotIn("detections", failed)
        for part in (os.path.basename(source), *parts):
            self.assertIn(part, outcome.err)
        self.assert_tags(good, images.SCENE_TAGS)
        table = self.run_here("detect", source, "photograph.png")
        self.assertEqual(table.code, 1)
        self.assertIn("photograph.png: 2 ", table.out)

    def test_images_after_a_tag_size_and_other_files_as_camera(self):
        with_sizes = self.run_here("detect", "--camera", "none.yaml", "--tag-size-m", 0.16, "photograph.png", "photograph.png")
        self.assertEqual(with_sizes.code, 1)
        self.assertIn("none.yaml: ", with_sizes.err)
        self.assertNotIn("photograph.png", with_sizes.err, "the images are not parsed as sizes")
        (self.folder / "camera.json.gz").write_bytes(gzip.compress(b"{}"))
        for file in ("camera.json.gz", "photograph.png"):
            outcome = self.run_here("detect", "photograph.png", "--tag-size-m", 0.16, "--camera", file)
            self.assertEqual(outcome.code, 1, "a calibration is an input")
            self.assertIn(f"{file}: ", outcome.err)
            golden_page.expect(self, "detect", outcome.err)

    def test_missing(self):
        self.check("photogarph.png", "not_found", "'photograph.png'?")

    def test_empty_file(self):
        (self.folder / "empty.png").touch()
        self.check("empty.png", "unreadable", "empty")

    def test_truncated(self):
        data = (self.folder / "photograph.png").read_bytes()
        (self.folder / "cut.png").write_bytes(data[: len(data) // 2])
        self.check("cut.png", "unreadable", "byte")
        (self.folder / "cut.pgm").write_bytes((self.folder / "photos/0002.pgm").read_bytes()[:-1])
        self.check("cut.pgm", "unreadable", "byte")
        (self.folder / "cut.jpg").write_bytes(images.CMYK_JPEG[:-40])
        self.check("cut.jpg", "unreadable")

    def test_not_an_image(self):
        (self.folder / "words.jpg").write_text("This is not an image.")
        self.check("words.jpg", "unreadable")

    def test_hostile_size(self):
        images.write_png(self.folder / "huge.png", [bytes(8)])
        data = bytearray((self.folder / "huge.png").read_bytes())
        data[16:24] = (90000).to_bytes(4, "big") * 2
        data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
        (self.folder / "huge.png").write_bytes(data)
        self.check("huge.png", "limit_exceeded", "90000")

    def test_more_pixels_than_the_detector_accepts(self):
        with open(self.folder / "large.pgm", "wb") as file:
            file.write(b"P5\n20000 3400\n255\n")
            file.write(bytes(20000 * 3400))
        self.check("large.pgm", "limit_exceeded", "20000")

    def test_folder_without_images(self):
        (self.folder / "none").mkdir()
        self.check("none", "not_found")

    def test_pattern_without_match(self):
        self.check("lap*.png", "not_found")

    def test_video_without_its_index(self):
        (self.folder / "lap.mp4").write_bytes(b"\0\0\0\x18ftypmp42")
        self.check("lap.mp4", "unreadable", "index")

    @unittest.skipIf(os.geteuid() == 0, "root may read everything")
    def test_no_permission(self):
        (self.folder / "secret.png").write_bytes(b"")
        (self.folder / "secret.png").chmod(0)
        self.check("secret.png", "unreadable", "ermission")

    def test_a_name_that_is_not_utf8(self):
        name = os.fsdecode(b"caf\xe9.png")
        shutil.copy(self.folder / "photograph.png", self.folder / name)
        outcome = self.run_here("detect", "--json", name)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assert_tags(outcome.records[0], images.SCENE_TAGS)


if __name__ == "__main__":
    unittest.main()
