#!/usr/bin/env python3
"""Measures the times of docs/performance.md and prints them as its tables.

  deploy/measure.py [--seconds S] [--only benchmark|memory|load|reload]

Needs a finished release build (deploy/test.sh) and an otherwise idle machine. `benchmark` runs
transfer_benchmark, every row of a table in the same run; `memory` runs the bundled pair once by each method in a
process of its own; `load` starts a server with every model in models/ and runs stance-load against it with 1, 4 and
16 clients on the bundled pair, by each method. Methods are those whose model is there. `reload` lets one client call,
with and without a reload of all models every other second, by turns, so that it can be told on a machine that is busy.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "release" / "bin"
PAIR = [str(ROOT / "deploy" / "sample" / name) for name in ("source.glb", "reference.glb")]
PHASES = ("check", "resample", "network", "pose", "weights", "deform")
CLIENTS = (1, 4, 16)
MODELS = {json.loads(path.read_text())["method"]: path.parent for path in sorted(ROOT.glob("models/*/manifest.json"))}
RELOAD_TURNS = 5
METHODS = [method for method in ("stance", "skeletal") if method in MODELS]


def table(head, rows):
    for cells in [head, ["---"] * len(head), *rows]:
        print("| " + " | ".join(str(cell) for cell in cells) + " |")
    print()


def number(value):
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}"


def measure_benchmark():
    command = [BIN / "transfer_benchmark", "--benchmark_format=json"]
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    runs = {run["name"].replace("/real_time", "").replace("/iterations:1", ""): run for run in report["benchmarks"]}
    ms = {name: run["real_time"] for name, run in runs.items()}

    rows = []
    labels = (
        ("Transfer/stance", "stance"),
        ("Transfer/sampled", "skeletal, the model's samples"),
        ("Transfer/full_resolution", "skeletal, every vertex"),
    )
    for name, label in labels:
        if name not in runs:
            continue
        rows.append([label, number(ms[name])] + [number(runs[name][f"{phase}_ms"]) for phase in PHASES])
    table(["ms", "total", *PHASES], rows)

    pairs = (
        ("f_C over 6,890 vertices, one thread", "decomposed", "Confidence/decomposed", "edge by edge", "Confidence/plain"),
        ("smooth weights of 6,890 vertices", "sparse Cholesky", "Weights/sparse", "dense solve", "Weights/dense"),
    )
    table(
        ["", "ours", "ms", "the papers'", "ms", "ratio"],
        [[what, ours, number(ms[a]), theirs, number(ms[b]), f"{ms[b] / ms[a]:.1f}"] for what, ours, a, theirs, b in pairs],
    )

    sizes = [512, 1024, 6890, 27556]
    rows = []
    for channels in (3, 64, 128):
        for label, kind in (("ours", "index"), ("Torch's cdist and topk", "torch")):
            rows.append([channels, label] + [number(ms[f"Knn/{kind}/{channels}/{size}"]) for size in sizes])
    table(["channels", "20 nearest, one thread, ms", *(f"{size:,} rows" for size in sizes)], rows)


def measure_memory():
    rows = []
    for method in METHODS:
        with tempfile.TemporaryDirectory() as folder:
            target = str(pathlib.Path(folder) / "target.glb")
            command = [BIN / "stance", "transfer", *PAIR, "-o", target, "--local", "--model", MODELS[method], "--quiet"]
            child = subprocess.Popen(command)
            _, status, usage = os.wait4(child.pid, 0)
        if status != 0:
            sys.exit(f"measure.py: stance transfer by {method} failed")
        rows.append([method, f"{usage.ru_maxrss / 1024:.0f}"])
    table(["`stance transfer --local` on the pair", "peak MB"], rows)


def measure_load(seconds):
    server = subprocess.Popen(
        [BIN / "stance-server", "--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0", "--model", ROOT / "models",
         "--inference-rig-cache-bytes", "0"],  # the clients send one pair, which would be known from then on
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        address = next((m[1] for line in server.stdout if (m := re.match(r"listening on (\S+)", line))), None)
        if address is None:
            sys.exit("measure.py: the server ended before it was ready")
        rows = []
        for method, clients in ((method, clients) for method in METHODS for clients in CLIENTS):
            command = [BIN / "stance-load", *PAIR, "--server", address, "--clients", str(clients)]
            command += ["--method", method, "--duration", str(seconds), "--warmup", "3", "--json"]
            report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
            latency = report["latency_ms"]
            rows.append(
                [method, clients, report["ok"], sum(report["errors"].values()), f"{report['throughput']:.1f}"]
                + [number(latency[key]) for key in ("p50", "p90", "p99", "max")]
            )
        table(["method", "clients", "answers", "errors", "answers/s", "p50 ms", "p90 ms", "p99 ms", "max ms"], rows)
    finally:
        server.send_signal(signal.SIGTERM)
        if server.wait(timeout=60) != 0:
            sys.exit("measure.py: the server did not stop cleanly")


def measure_reload(seconds):
    with tempfile.TemporaryDirectory() as folder:
        models, log = pathlib.Path(folder) / "models", pathlib.Path(folder) / "log"
        shutil.copytree(ROOT / "models", models)
        with open(log, "wb") as stderr:
            server = subprocess.Popen(
                [BIN / "stance-server", "--listen", "127.0.0.1:0", "--metrics-listen", "", "--model", models],
                stdout=subprocess.PIPE,
                stderr=stderr,
                text=True,
            )
        done = threading.Event()

        def reload():
            while not done.wait(2):
                for manifest in models.glob("*/manifest.json"):
                    manifest.touch()
                server.send_signal(signal.SIGHUP)

        try:
            address = server.stdout.readline().removeprefix("listening on ").strip()
            command = [BIN / "stance-load", *PAIR, "--server", address, "--clients", "1", "--timeout", "120"]
            command += ["--duration", str(seconds), "--warmup", "3", "--json"]
            rows, reports = [], {"without": [], "with": []}
            for turn in range(RELOAD_TURNS):
                for kind in reports:
                    done.clear()
                    thread = threading.Thread(target=reload)
                    if kind == "with":
                        thread.start()
                    report = subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
                    reports[kind].append(json.loads(report))
                    done.set()
                    if kind == "with":
                        thread.join()
            for kind, some in reports.items():
                latency = [[report["latency_ms"][key] for report in some] for key in ("p50", "p90", "p99")]
                rows.append(
                    [kind, sum(report["ok"] for report in some), sum(sum(r["errors"].values()) for r in some)]
                    + [number(statistics.median(each)) for each in latency]
                )
            ratios = [statistics.median(r["latency_ms"][key] for r in reports["with"])
                      / statistics.median(r["latency_ms"][key] for r in reports["without"]) for key in ("p50", "p90", "p99")]
            rows.append(["ratio", "", "", *(f"{ratio:.2f}" for ratio in ratios)])
            table(["reloads", "answers", "errors", "p50 ms", "p90 ms", "p99 ms"], rows)
            print(log.read_text().count('"models reloaded"'), "reloads\n")
        finally:
            done.set()
            server.send_signal(signal.SIGTERM)
            server.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20, help="length of each load run [20]")
    parser.add_argument("--only", choices=("benchmark", "memory", "load", "reload"), help="one of them")
    arguments = parser.parse_args()
    if arguments.only in (None, "benchmark"):
        measure_benchmark()
    if arguments.only in (None, "memory"):
        measure_memory()
    if arguments.only in (None, "load"):
        measure_load(arguments.seconds)
    if arguments.only in (None, "reload"):
        measure_reload(arguments.seconds)


if __name__ == "__main__":
    main()
