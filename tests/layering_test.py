#!/usr/bin/env python3
"""Keeps the include rules of docs/architecture.md.

    layering_test.py ROOT         checks the tree; prints FILE:LINE: what is wrong; exit status 1 if anything is
    layering_test.py --self-test  checks that each rule finds its own violation, and passes a good tree
    layering_test.py --torch ROOT lists the .cc files that include Torch, themselves or through our headers

Debian keeps the headers of LibTorch, OpenMesh and gRPC in /usr/include, so a PRIVATE link does not hide them;
this test does.
"""

import pathlib
import re
import sys
import tempfile
import unittest

CORE_BELOW_TRANSFER = {"core/base", "core/mesh", "core/skeleton"}

# Which folders' headers a folder may include; a folder without a line of its own has its parent's. "stance/v1"
# are the generated messages, whose use is judged with gRPC's and protobuf's below.
MAY_INCLUDE = {
    "core/base": {"core/base"},
    "core/mesh": {"core/mesh", "core/base"},
    "core/skeleton": {"core/skeleton", "core/base"},
    "core/network": CORE_BELOW_TRANSFER | {"core/network"},
    "core/transfer": CORE_BELOW_TRANSFER | {"core/network", "core/transfer"},
    "core/training": CORE_BELOW_TRANSFER | {"core/network", "core/transfer", "core/training"},
    "proto/wire": CORE_BELOW_TRANSFER | {"core/transfer", "proto/wire"},
    "server/access": {"core/base", "server/access"},
    "server/batching": {"core/base", "server/batching"},
    "server": CORE_BELOW_TRANSFER | {"core/transfer", "proto/wire", "server/access", "server/batching", "server"},
    "client": CORE_BELOW_TRANSFER | {"core/transfer", "proto/wire", "client"},
    "tests": {"core", "proto", "server", "client", "tests"},
}

SERVICE = {"proto", "server", "client", "tests"}

# (name, pattern of the include, folders that may, whether .cc files only).
EXTERNAL = [
    ("Torch", r"(torch|ATen|c10|caffe2)/", {"core/network", "core/training", "tests"}, False),
    ("gRPC", r"(grpcpp?|grpc\+\+)/|.*\.grpc\.pb\.h$", SERVICE, False),
    ("protobuf", r"google/(protobuf|rpc)/|.*\.pb\.h$", SERVICE, False),
    ("the server's libraries", r"(spdlog|prometheus|toml\+\+)/", {"server", "tests"}, False),
    ("OpenSSL", r"openssl/", {"core/base", "server", "tests"}, True),
    ("OpenMesh", r"OpenMesh/", {"core", "tests"}, True),
    ("a file-format library", r"(stb/)?stb_|tiny_?gltf|assimp/|zlib\.h$", {"core", "tests"}, True),
    ("nanoflann", r"nanoflann\.hpp$", {"core", "tests"}, True),
]
# Folders inside those above that may not.
EXTERNAL_NEVER = {"server/batching"}

# Where a quoted include may start: our folders, and what is generated or installed under such a name.
OURS = ("core/", "proto/", "server/", "client/", "tests/")
OTHERS = ("stance/v1/", "google/", "grpc/", "absl/")

INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')


def is_under(path, folders):
    return any(path == folder or path.startswith(folder + "/") for folder in folders)


def rule_of(folder):
    """The longest line of MAY_INCLUDE that holds the folder, or None."""
    fitting = [name for name in MAY_INCLUDE if is_under(folder, {name})]
    return max(fitting, key=len, default=None)


def includes_of(text):
    for number, line in enumerate(text.splitlines(), 1):
        if match := INCLUDE.match(line):
            yield number, match[1] == '"', match[2]


def header_hygiene(text):
    lines = text.splitlines()
    if not lines or not lines[0].startswith("//"):
        return "a header starts with a comment that says what it is"
    code = next((line for line in lines if not line.startswith("//")), "")
    if code != "#pragma once":
        return "#pragma once follows the header's first comment"
    return None


def check_include(path, quoted, target, sources, torch_headers):
    folder = path.rsplit("/", 1)[0]
    rule = rule_of(folder)
    if rule is None:
        return f"{folder} has no line in MAY_INCLUDE"
    if quoted and not target.startswith(OURS + OTHERS):
        return f'"{target}" does not start at the root of the tree'
    if target.startswith(OURS):
        if not quoted:
            return f"<{target}> is ours: use quotes"
        if target not in sources:
            return f'"{target}" does not exist'
        owner = target.rsplit("/", 1)[0]
        # The longest rule decides, so that a folder with a line of its own is not allowed by its parent's.
        if not is_under(rule_of(owner) or owner, MAY_INCLUDE[rule]):
            return f'{rule} may not include "{target}"'
        if target in torch_headers and not is_under(folder, EXTERNAL[0][2]):
            return f'"{target}" brings in Torch, which {rule} may not include'
        return None
    for name, pattern, folders, source_only in EXTERNAL:
        if not re.match(pattern, target):
            continue
        if not is_under(folder, folders) or is_under(folder, EXTERNAL_NEVER):
            return f"{rule} may not include {name} ({target})"
        if source_only and path.endswith(".h"):
            return f"{name} ({target}) belongs in .cc files"
    return None


def headers_with_torch(sources):
    """The headers of the tree that include Torch, themselves or through others."""
    found = {path for path, text in sources.items() if path.endswith(".h") and
             any(re.match(EXTERNAL[0][1], target) for _, _, target in includes_of(text))}
    while True:
        more = {path for path, text in sources.items() if path.endswith(".h") and path not in found and
                any(target in found for _, _, target in includes_of(text))}
        if not more:
            return found
        found |= more


def sources_with_torch(sources):
    headers = headers_with_torch(sources)
    return sorted(path for path, text in sources.items() if path.endswith(".cc") and
                  any(target in headers or re.match(EXTERNAL[0][1], target) for _, _, target in includes_of(text)))


def check_sources(sources):
    """The violations in {path: text} as 'path:line: text'."""
    problems = []
    torch_headers = headers_with_torch(sources)
    for path, text in sorted(sources.items()):
        if path.endswith(".h") and (problem := header_hygiene(text)):
            problems.append(f"{path}:1: {problem}")
        for number, quoted, target in includes_of(text):
            if problem := check_include(path, quoted, target, sources, torch_headers):
                problems.append(f"{path}:{number}: {problem}")
    return problems


def read_tree(root):
    sources = {}
    for top in ("core", "proto", "server", "client", "tests"):
        # CMake makes x.h from x.h.in.
        for suffix in ("*.h", "*.h.in", "*.cc"):
            for path in sorted((root / top).rglob(suffix)):
                name = path.relative_to(root).as_posix().removesuffix(".in")
                sources[name] = path.read_text(encoding="utf-8")
    return sources


HEADER = "// A header.\n#pragma once\n"
GOOD = {
    "core/base/a.h": HEADER + "#include <vector>\n",
    "core/mesh/m.h": HEADER + '#include "core/base/a.h"\n',
    "core/mesh/m.cc": '#include "core/mesh/m.h"\n#include <OpenMesh/Core/x.hh>\n#include <nanoflann.hpp>\n',
    "core/skeleton/s.h": HEADER + '#include "core/base/a.h"\n',
    "core/network/tensors.h": HEADER + "#include <torch/torch.h>\n",
    "core/network/layer.h": HEADER + '#include "core/network/tensors.h"\n',
    "core/network/model.h": HEADER + '#include "core/mesh/m.h"\n',
    "core/network/model.cc": '#include "core/network/model.h"\n#include "core/network/layer.h"\n',
    "core/transfer/p.h": HEADER + '#include "core/network/model.h"\n',
    "core/training/t.cc": '#include "core/transfer/p.h"\n#include "core/network/layer.h"\n',
    "proto/wire/w.h": HEADER + '#include "core/transfer/p.h"\n#include "stance/v1/mesh.pb.h"\n',
    "server/s.cc": '#include "server/batching/b.h"\n#include "proto/wire/w.h"\n#include <grpcpp/server.h>\n',
    "server/access/a.h": HEADER + '#include "core/base/a.h"\n',
    "server/access/a.cc": '#include "server/access/a.h"\n#include <openssl/sha.h>\n',
    "server/t.cc": '#include "server/access/a.h"\n',
    "server/batching/b.h": HEADER + '#include "core/base/a.h"\n',
    "client/cli/c.cc": '#include "core/transfer/p.h"\n#include "stance/v1/mesh.grpc.pb.h"\n',
    "tests/core/network/t.cc": '#include "core/network/layer.h"\n#include "server/batching/b.h"\n',
}

# What each rule refuses: (file, its text, what the message says).
BAD = [
    ("core/base/x.cc", '#include "core/mesh/m.h"\n', "core/base may not include"),
    ("core/mesh/x.cc", '#include "core/skeleton/s.h"\n', "core/mesh may not include"),
    ("core/skeleton/x.cc", '#include "core/mesh/m.h"\n', "core/skeleton may not include"),
    ("core/network/x.cc", '#include "core/transfer/p.h"\n', "core/network may not include"),
    ("core/transfer/x.cc", '#include "core/training/x.h"\n', "core/transfer may not include"),
    ("core/transfer/x.cc", '#include "core/network/layer.h"\n', "brings in Torch"),
    ("core/transfer/x.cc", "#include <torch/torch.h>\n", "may not include Torch"),
    ("core/mesh/x.cc", "#include <ATen/Parallel.h>\n", "may not include Torch"),
    ("core/training/x.cc", '#include "server/batching/b.h"\n', "core/training may not include"),
    ("core/transfer/x.cc", "#include <grpcpp/grpcpp.h>\n", "may not include gRPC"),
    ("core/transfer/x.cc", '#include "stance/v1/mesh.pb.h"\n', "may not include protobuf"),
    ("core/transfer/x.cc", '#include "stance/v1/mesh.grpc.pb.h"\n', "may not include gRPC"),
    ("core/transfer/x.cc", "#include <spdlog/spdlog.h>\n", "the server's libraries"),
    ("core/mesh/x.h", HEADER + "#include <OpenMesh/Core/x.hh>\n", "belongs in .cc files"),
    ("core/mesh/x.h", HEADER + "#include <tiny_gltf.h>\n", "belongs in .cc files"),
    ("core/mesh/x.h", HEADER + "#include <nanoflann.hpp>\n", "belongs in .cc files"),
    ("core/mesh/x.h", HEADER + "#include <assimp/scene.h>\n", "belongs in .cc files"),
    ("server/x.cc", "#include <OpenMesh/Core/x.hh>\n", "may not include OpenMesh"),
    ("server/x.cc", '#include "core/network/model.h"\n', "server may not include"),
    ("server/x.cc", '#include "core/training/x.h"\n', "server may not include"),
    ("server/x.cc", '#include "client/x.h"\n', "server may not include"),
    ("server/access/x.h", HEADER + '#include "server/x.h"\n', "server/access may not include"),
    ("server/access/x.h", HEADER + '#include "server/batching/b.h"\n', "server/access may not include"),
    ("server/batching/x.h", HEADER + '#include "server/access/a.h"\n', "server/batching may not include"),
    ("server/access/x.h", HEADER + "#include <openssl/sha.h>\n", "belongs in .cc files"),
    ("client/x.cc", "#include <openssl/sha.h>\n", "may not include OpenSSL"),
    ("server/batching/x.h", HEADER + '#include "core/transfer/p.h"\n', "server/batching may not include"),
    ("server/batching/x.h", HEADER + '#include "server/x.h"\n', "server/batching may not include"),
    ("server/batching/x.h", HEADER + "#include <grpcpp/server.h>\n", "server/batching may not include gRPC"),
    ("client/x.cc", '#include "server/x.h"\n', "client may not include"),
    ("client/x.cc", '#include "core/network/model.h"\n', "client may not include"),
    ("proto/wire/x.cc", '#include "server/x.h"\n', "proto/wire may not include"),
    ("core/mesh/x.cc", '#include "m.h"\n', "does not start at the root"),
    ("core/mesh/x.cc", '#include "../network/layer.h"\n', "does not start at the root"),
    ("core/mesh/x.cc", "#include <core/network/layer.h>\n", "use quotes"),
    ("core/mesh/x.cc", '#include "core/mesh/gone.h"\n', "does not exist"),
    ("core/mesh/x.cc", '#  include   "core/transfer/p.h"\n', "core/mesh may not include"),
    ("core/extra/x.cc", "#include <vector>\n", "has no line"),
    ("core/mesh/x.h", "#pragma once\n", "starts with a comment"),
    ("core/mesh/x.h", "", "starts with a comment"),
    ("core/mesh/x.h", "// A header.\n#include <vector>\n#pragma once\n", "#pragma once follows"),
    ("core/mesh/x.h", "// A header.\n", "#pragma once follows"),
]


class SelfTest(unittest.TestCase):
    def test_a_good_tree_passes(self):
        self.assertEqual(check_sources(GOOD), [])

    def test_each_violation_is_found_where_it_is(self):
        others = {name: HEADER for name in ("core/training/x.h", "server/x.h", "client/x.h")}
        for path, text, message in BAD:
            with self.subTest(path=path, text=text):
                problems = check_sources({**others, **GOOD, path: text})
                self.assertEqual(len(problems), 1, problems)
                self.assertTrue(problems[0].startswith(path + ":"), problems)
                self.assertIn(message, problems[0])

    def test_the_line_is_the_includes_own(self):
        text = "// A comment.\n\n#include <vector>\n#include <torch/torch.h>\n"
        self.assertIn("core/mesh/x.cc:4:", check_sources({**GOOD, "core/mesh/x.cc": text})[0])

    def test_torch_is_seen_through_any_number_of_headers(self):
        chain = {"core/network/far.h": HEADER + '#include "core/network/layer.h"\n',
                 "core/transfer/x.cc": '#include "core/network/far.h"\n'}
        self.assertIn("brings in Torch", check_sources({**GOOD, **chain})[0])

    def test_files_with_torch_are_listed(self):
        self.assertEqual(sources_with_torch(GOOD), ["core/network/model.cc", "core/training/t.cc",
                                                    "tests/core/network/t.cc"])

    def test_a_tree_on_disk_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, text in {**GOOD, "core/mesh/x.cc": "#include <torch/torch.h>\n"}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text, encoding="utf-8")
            self.assertEqual(main([str(root)], report=lambda line: None), 1)
            (root / "core/mesh/x.cc").unlink()
            self.assertEqual(main([str(root)], report=lambda line: None), 0)

    def test_a_folder_without_sources_is_not_a_pass(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(main([folder], report=lambda line: None), 1)


def main(arguments, report=print):
    sources = read_tree(pathlib.Path(arguments[0]))
    if not any(path.startswith("core/") for path in sources):
        report(f"{arguments[0]}: no sources under core/")
        return 1
    problems = check_sources(sources)
    for problem in problems:
        report(problem)
    report(f"{len(sources)} files, {len(problems)} violations")
    return 1 if problems else 0


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        unittest.main(argv=sys.argv[:1])
    if len(sys.argv) == 3 and sys.argv[1] == "--torch":
        print("\n".join(sources_with_torch(read_tree(pathlib.Path(sys.argv[2])))))
        sys.exit(0)
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1:]))
