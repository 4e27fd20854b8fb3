#!/usr/bin/env python3
"""Checks the dashboard, the alert rules and the documents against the metrics page of a real server, and the page
against a real Prometheus.

    observability_test.py ROOT SERVER CLIENT MODEL OPENSSL [PROMETHEUS PROMTOOL]

Without Prometheus (Debian's package of that name) its tests are skipped.
"""

import hashlib
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

ROOT, SERVER, CLIENT, MODEL, OPENSSL = sys.argv[1:6]
PROMETHEUS, PROMTOOL = (sys.argv[6:8] + ["", ""])[:2]
ROOT = pathlib.Path(ROOT)
RULES = ROOT / "deploy/prometheus/stance-alerts.yml"
DASHBOARD = ROOT / "deploy/grafana/stance-dashboard.json"
OPERATIONS = ROOT / "docs/operations.md"

NAME = re.compile(r"\b(?:stance|process)_[a-z_]+\b")
TOKEN = "a-token-of-this-test"
PATIENCE = 60  # seconds; a limit for a machine that is slow, not a pace


def await_true(what, condition):
    deadline = time.monotonic() + PATIENCE
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {PATIENCE} s: {what}")
        time.sleep(0.05)
    return value


def get(url):
    with urllib.request.urlopen(url, timeout=PATIENCE) as answer:
        return answer.read().decode()


def expressions():
    """The dashboard's, with Grafana's variables replaced as Grafana does, and without the filter that leaves out what
    is 0: nobody calls while they are asked."""
    found = []
    for panel in json.loads(DASHBOARD.read_text())["panels"]:
        for target in panel.get("targets", []):
            found.append(target["expr"].replace("$__rate_interval", "30s").replace("$instance", ".*")
                         .replace(" > 0", ""))
    return found


class ObservabilityTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.addClassCleanup(cls.stop)
        cls.programs = []
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        certificate, key, tokens = cls.folder / "cert.pem", cls.folder / "key.pem", cls.folder / "tokens.toml"
        subprocess.run([OPENSSL, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-days", "30", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
                        "-keyout", key, "-out", certificate], check=True, capture_output=True)
        tokens.write_text(f'[clients.test]\ntoken_sha256 = "{hashlib.sha256(TOKEN.encode()).hexdigest()}"\n')
        # Everything that has metrics is turned on.
        cls.log = cls.folder / "server.log"
        server = cls.start([SERVER, "--model", MODEL, "--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0",
                            "--server-lame-duck-seconds", "0", "--tls-certificate", certificate, "--tls-key", key,
                            "--auth-token-file", tokens], cls.log, stdout=subprocess.PIPE)
        line = server.stdout.readline().decode()
        if not line.startswith("listening on "):
            raise AssertionError(cls.log.read_text())
        serving = next(json.loads(line) for line in cls.log.read_text().splitlines() if '"serving"' in line)
        cls.address = serving["metrics"]

        def client(token):
            (cls.folder / "token").write_text(token)
            return subprocess.run([CLIENT, "transfer", ROOT / "deploy/sample/source.glb",
                                   ROOT / "deploy/sample/reference.glb", "-o", cls.folder / "out.obj",
                                   "--server", line.removeprefix("listening on ").strip(), "--tls-ca", certificate,
                                   "--token-file", cls.folder / "token"], capture_output=True, check=False)
        served = client(TOKEN)
        if served.returncode != 0:
            raise AssertionError(served.stderr.decode())
        if client("wrong").returncode != 5:
            raise AssertionError("a wrong token was served")
        cls.page = get(f"http://{cls.address}/metrics")
        cls.families = set(re.findall(r"^# TYPE (\S+)", cls.page, re.MULTILINE))

    @classmethod
    def start(cls, command, log, **more):
        with open(log, "wb") as stderr:
            cls.programs.append(subprocess.Popen(command, stderr=stderr, **more))
        return cls.programs[-1]

    @classmethod
    def stop(cls):
        for program in cls.programs:
            program.send_signal(signal.SIGTERM)
            program.communicate()
        shutil.rmtree(cls.folder)

    def family(self, name):
        """The family of a sample's name."""
        for suffix in ("_bucket", "_sum", "_count"):
            if name not in self.families and name.removesuffix(suffix) in self.families:
                return name.removesuffix(suffix)
        return name

    def test_every_metric_in_use_is_on_the_page(self):
        for text in (RULES.read_text(), DASHBOARD.read_text()):
            names = set(NAME.findall(text))
            self.assertGreater(len(names), 5)
            self.assertEqual({name for name in names if self.family(name) not in self.families}, set())

    def test_the_documents_list_the_page(self):
        section = OPERATIONS.read_text().split("\n## Metrics\n")[1].split("\n## ")[0]
        listed = {name for line in section.splitlines() if line.startswith("| `")
                  for name in NAME.findall(line.split("|")[1])}
        self.assertEqual(listed, self.families)

    def test_names_tell_kind_and_unit(self):
        kinds = dict(re.findall(r"^# TYPE (\S+) (\S+)", self.page, re.MULTILINE))
        for name, kind in kinds.items():
            self.assertEqual(kind == "counter", name.endswith("_total"), name)
            if kind == "histogram":
                self.assertRegex(name, "_(seconds|bytes|requests|vertices)$")
            self.assertRegex(self.page, f"(?m)^# HELP {name} \\S")
            self.assertNotRegex(name, "milli|micro|_ms|_us|kilo|mega|_kb|_mb|percent")

    @unittest.skipUnless(PROMTOOL, "promtool is not installed")
    def test_promtool_has_nothing_to_say(self):
        checks = [(["check", "metrics"], self.page.encode()), (["check", "rules", RULES], b"")]
        for words, text in checks:
            done = subprocess.run([PROMTOOL, *words], input=text, capture_output=True, check=False)
            self.assertEqual((done.returncode, done.stderr.decode()), (0, ""), done.stdout.decode())

    @unittest.skipUnless(PROMTOOL, "promtool is not installed")
    def test_each_alert_fires_and_stays_quiet(self):
        alerts = re.findall(r"- alert: (\w+)", RULES.read_text())
        tests = (ROOT / "tests/deploy/alerts_test.yml").read_text()
        self.assertEqual({name for name in alerts if name not in tests}, set())
        self.assertIn(f"value: {len(alerts)}", tests)
        shutil.copy(RULES, self.folder)
        (self.folder / "alerts_test.yml").write_text(tests)
        done = subprocess.run([PROMTOOL, "test", "rules", "alerts_test.yml"], cwd=self.folder, capture_output=True,
                              check=False)
        self.assertEqual(done.returncode, 0, done.stdout.decode() + done.stderr.decode())

    @unittest.skipUnless(PROMETHEUS, "prometheus is not installed")
    def test_a_real_prometheus_scrapes_and_answers(self):
        config = self.folder / "prometheus.yml"
        config.write_text(json.dumps({
            "global": {"scrape_interval": "1s", "evaluation_interval": "1s"}, "rule_files": [str(RULES)],
            "scrape_configs": [{"job_name": "stance", "static_configs": [{"targets": [self.address]}]}]}))
        log = self.folder / "prometheus.log"
        self.start([PROMETHEUS, f"--config.file={config}", f"--storage.tsdb.path={self.folder / 'data'}",
                    "--web.listen-address=127.0.0.1:0"], log, stdout=subprocess.DEVNULL)
        # The address that is bound comes last.
        heard = re.compile(r'address="?(127\.0\.0\.1:[1-9]\d*)')
        address = await_true("Prometheus listens", lambda: heard.findall(log.read_text()))[-1]

        def query(expression):
            words = urllib.parse.urlencode({"query": expression})
            try:
                answer = json.loads(get(f"http://{address}/api/v1/query?{words}"))
            except urllib.error.HTTPError as error:
                raise AssertionError(f"{expression}: {error.read().decode()}") from error
            self.assertEqual(answer["status"], "success")
            return answer["data"]["result"]

        await_true("Prometheus is ready", lambda: self.is_ready(address))
        served = 'stance_requests_total{job="stance", code="OK", rpc="Transfer"}'
        result = await_true("a scrape", lambda: query(served))
        self.assertEqual([sample["value"][1] for sample in result], ["1"])
        for expression in expressions():
            with self.subTest(expression):
                await_true(expression, lambda expression=expression: query(expression))

        def rules():
            groups = json.loads(get(f"http://{address}/api/v1/rules"))["data"]["groups"]
            found = [rule for group in groups for rule in group["rules"]]
            return found if found and all(rule["health"] != "unknown" for rule in found) else None
        for rule in await_true("the rules are evaluated", rules):
            self.assertEqual(rule["health"], "ok", rule)
            self.assertEqual(rule["state"], "inactive", rule)

    @staticmethod
    def is_ready(address):
        try:
            return "eady" in get(f"http://{address}/-/ready")
        except OSError:
            return False


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
