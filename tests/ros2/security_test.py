#!/usr/bin/python3
"""DDS Security in the layout of SROS 2, with certificates that openssl creates here. A program without a certificate, or with one of another authority,
receives nothing. Both sides are Waymark on Fast DDS: Debian's Cyclone DDS has no security plugins.

usage: security_test.py PROGRAM PEER
"""
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import installed  # noqa: E402
from wire_case import LONG, PROGRAM, Wire

NAMESPACE = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
GOVERNANCE = f"""<?xml version="1.0" encoding="UTF-8"?>
<dds {NAMESPACE} xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
<domain_access_rules><domain_rule><domains><id_range><min>0</min><max>232</max></id_range></domains>
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind><liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>SIGN</rtps_protection_kind>
<topic_access_rules><topic_rule><topic_expression>*</topic_expression><enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection><enable_read_access_control>true</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control><metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>ENCRYPT</data_protection_kind></topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>
"""
PERMISSIONS = f"""<?xml version="1.0" encoding="UTF-8"?>
<dds {NAMESPACE} xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
<permissions><grant name="waymark"><subject_name>CN=/waymark</subject_name>
<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2120-01-01T00:00:00</not_after></validity>
<allow_rule><domains><id_range><min>0</min><max>232</max></id_range></domains><publish><topics><topic>*</topic></topics></publish>
<subscribe><topics><topic>*</topic></topics></subscribe></allow_rule><default>DENY</default></grant></permissions></dds>
"""


def openssl(folder, *words):
    subprocess.run([installed.program("openssl", "openssl"), *words], cwd=folder, check=True, capture_output=True)


def make_enclave(folder):
    """A keystore with one authority and the enclave /waymark."""
    enclave = folder / "enclaves/waymark"
    enclave.mkdir(parents=True)
    new_key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    openssl(folder, "req", "-x509", *new_key, "-keyout", "ca.key.pem", "-out", "ca.cert.pem", "-days", "3650", "-subj", "/CN=sros2CA")
    openssl(folder, "req", *new_key, "-keyout", enclave / "key.pem", "-out", "waymark.csr", "-subj", "/CN=\\/waymark")
    openssl(folder, "x509", "-req", "-in", "waymark.csr", "-CA", "ca.cert.pem", "-CAkey", "ca.key.pem", "-CAcreateserial", "-days", "3650",
            "-out", enclave / "cert.pem")
    for name, text in (("governance", GOVERNANCE), ("permissions", PERMISSIONS)):
        (folder / f"{name}.xml").write_text(text)
        openssl(folder, "smime", "-sign", "-text", "-in", f"{name}.xml", "-out", enclave / f"{name}.p7s", "-signer", "ca.cert.pem", "-inkey", "ca.key.pem")
    for name in ("identity_ca", "permissions_ca"):
        shutil.copy(folder / "ca.cert.pem", enclave / f"{name}.cert.pem")


class Security(Wire):
    def secured(self, keystore):
        return {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_KEYSTORE": str(keystore), "ROS_SECURITY_ENCLAVE_OVERRIDE": "/waymark"}

    @LONG
    def test_only_programs_with_a_certificate_of_this_authority_communicate(self):
        plain = dict(self.environment)
        for name in ("ours", "theirs"):
            (self.folder / name).mkdir()
            make_enclave(self.folder / name)
        self.environment = {**plain, **self.secured(self.folder / "ours")}
        self.start(PROGRAM, "robot-sim", "--world", "mbot-square", "--ros2", stdout=subprocess.DEVNULL)
        heard = self.run_program("ros2", "topic", "hz", "/odom", "--count", 20)
        self.assertEqual(heard.returncode, 0, heard.stderr)
        self.assertGreater(float(heard.stdout.split()[0]), 10, heard.stdout)
        for environment in (plain, {**plain, **self.secured(self.folder / "theirs")}):
            self.environment = environment
            listing = self.run_program("ros2", "topic", "list")
            self.assertEqual((listing.returncode, listing.stdout), (1, ""), listing.stderr)

    def test_reports_the_folder_of_missing_certificates(self):
        (self.folder / "ours").mkdir()
        make_enclave(self.folder / "ours")
        (self.folder / "ours/enclaves/waymark/permissions.p7s").unlink()
        self.environment.update(self.secured(self.folder / "ours"))
        listing = self.run_program("ros2", "topic", "list")
        self.assertEqual(listing.returncode, 1, listing.stdout)
        self.assertIn(f"{self.folder}/ours/enclaves/waymark", listing.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
