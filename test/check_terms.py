#!/usr/bin/python3
"""The vocabulary of the code: retired words must not occur in names, strings, comments and pages of the folders below."""
import io
import pathlib
import re
import sys
import tokenize
import unittest

import rosunit

PACKAGE = "mono_pose_tracker"
REPOSITORY = pathlib.Path(__file__).resolve().parent.parent

# Word (a regex) and what to write instead. Words are compared in lower case; underscores and CamelCase separate words.
RETIRED = {
    r"sights?|sighted|seers?": "observation, viewing ray, observing keyframe",
    r"(un)?posed": "registered",
    r"resect(s|ed|ion|or)?": "absolute pose (PnP), registration",
    r"body|bodies": "object, motion segment",
    r"rivals?": "alternative hypothesis",
    r"twins?": "second solution, planar two-fold ambiguity",
    r"ties?|tied|tying": "shared track, cross-view match, connection",
    r"seams?": "weakest cut, boundary",
    r"a?strays?|misplaced|leaps?|leapt": "outlier, misregistered",
    r"torn": "duplicate landmark (split track)",
    r"(look[ _-]?)?alikes?": "similar, equal; perceptual aliasing",
    r"remade|remakes?|remaking": "retriangulated, rebuilt",
    r"chance[ _]pairs?": "accidental matches",
    r"lanes?": "SIMD packet",
    r"dearer|cheaper": "higher cost, lower cost",
    r"founded": "name the verdict",
    r"kept_maps": "inactive maps",
    r"(left|leaves?|leaving)_out|out_left": "excluded",
}
# Retired as names only: in a sentence they are ordinary words.
RETIRED_NAMES = {r"besides?": "name what is meant (inactive map, default topic)"}

# A folder of this list is checked under src, include and test.
FOLDERS = ["common", "camera", "geometry", "robust", "features", "segmentation", "map", "optimization", "io", "evaluation",
           "simulation", "mapping", "tracking", "pipeline", "tools", "ros", "python", "benchmarks", "quality", "fuzz", "lint",
           "support"]
OTHERS = ["scripts", "doc", "config", "launch", "msg", "README.md", "CONTRIBUTING.md", "CMakeLists.txt"]
SUFFIXES = {"", ".h", ".cpp", ".py", ".test", ".html", ".txt", ".cmake", ".md", ".yaml", ".launch", ".msg"}

# Regex of what stays, and why.
EXCEPTIONS = {
    r"\bframes_(not_)?posed\w*": "published: report.json, TrackerStatus, pymonopose, reports of benchmarks",
    r'"frames posed"': "published: key of the diagnostics",
    r"\bweakest_seam_points\b": "published: key of report.json",
    r'"resect"|`resect`(?= \(absolute pose\))|<td>resect</td>': "published: name of a stage",
    r"\bresection(?=/\w|:$)": "published: group of options",
    r"\bRegistrationOptions resection;|\b(o|options_|TrackerOptions\(\))(->|\.)resection\.|= resection\.min_inliers":
        "the field of the published options",
    r"segmentation/body\b|^\s*body: (largest|turning)|\"body\": \"largest\"": "published: option",
    r"std::string body = \"largest\"|return body == \"turning\"|\bsegmentation\.body\b": "the field of the published option",
    r"std::tie\b": "the standard library's",
    r"</?body>|^\s*html, body \{": "HTML",
    r"Lane and Riesenfeld": "an author",
}

CPP_NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def pattern_of(words):
    return re.compile("(?<![a-z])(?:%s)(?![a-z])" % "|".join(f"(?:{word})" for word in words))


RETIRED_PATTERN = pattern_of(RETIRED)
NAME_PATTERN = pattern_of(RETIRED_NAMES)
EXCEPTION_PATTERN = re.compile("|".join(f"(?:{e})" for e in EXCEPTIONS), re.MULTILINE)


def in_words(text):
    """CamelCase as snake_case, in lower case."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", text).lower()


def names_in(suffix, text):
    """The lines of the text with nothing but names in them: no comments, no strings."""
    if suffix in (".h", ".cpp"):
        return CPP_NO_CODE.sub(lambda found: "\n" * found.group().count("\n"), text)
    if suffix == ".py":
        lines = [""] * (text.count("\n") + 2)
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.NAME:
                lines[token.start[0] - 1] += " " + token.string
        return "\n".join(lines)
    return "\n".join(" ".join(re.findall(r"\w*_\w*", line)) for line in text.split("\n"))


def retired_words(suffix, text):
    """(line, word) of each retired word in a file with this suffix."""
    def blank(text):
        return EXCEPTION_PATTERN.sub(lambda found: " " * len(found.group()), text)
    for pattern, searched in ((RETIRED_PATTERN, text), (NAME_PATTERN, names_in(suffix, text))):
        for number, line in enumerate(blank(searched).split("\n"), 1):
            for found in pattern.finditer(in_words(line)):
                yield number, found.group()


def checked_files():
    tops = [pathlib.Path(top, folder) for folder in FOLDERS for top in ("src", "include/" + PACKAGE, "test")]
    for top in tops + [pathlib.Path(other) for other in OTHERS]:
        top = REPOSITORY / top
        for path in [top] if top.is_file() else sorted(top.rglob("*")):
            if path.is_file() and path.suffix in SUFFIXES and not {"corpus", "data", "__pycache__"} & set(path.parts):
                yield path


class TermsTest(unittest.TestCase):
    def test_no_retired_word_is_used(self):
        advice = {**RETIRED, **RETIRED_NAMES}
        found = []
        for path in checked_files():
            for number, word in retired_words(path.suffix, path.read_text()):
                better = next(a for w, a in advice.items() if re.fullmatch(w, word))
                found.append(f"{path.relative_to(REPOSITORY)}:{number}: {word}: write {better}")
        self.assertFalse(found, "\n" + "\n".join(found))

    def test_every_folder_is_checked(self):
        known = set(FOLDERS) | {"data", "regression", "sanitizers"}
        there = {path.name for top in ("src", "include/" + PACKAGE, "test") for path in (REPOSITORY / top).iterdir()
                 if path.is_dir() and path.name != "__pycache__"}
        self.assertEqual(there - known, set())

    def test_every_exception_is_needed(self):
        text = "\n".join(path.read_text() for path in checked_files())
        for exception in EXCEPTIONS:
            self.assertTrue(re.search(exception, text, re.MULTILINE), exception)

    def test_a_retired_word_is_found(self):
        for text in ("int tied_pairs;", "struct SightError;", "constexpr int kLanes = 4;", "// the twin of a plane",
                     'warn("it went astray");', "auto x = by_body();", "bool isLookAlike();", "  chance pairs", "kept_maps.size()",
                     "num_rivals", "is_left_out", "HTTPSeam"):
            self.assertTrue(list(retired_words(".cpp", text)), text)
        self.assertEqual(list(retired_words(".cpp", "int a;\nint beside_ = 0;")), [(2, "beside")])
        self.assertTrue(list(retired_words(".py", "def beside():\n    pass\n")))
        self.assertTrue(list(retired_words("", "list=to_run_beside")))

    def test_other_words_are_not_found(self):
        for text in ("// nobody, somebody, planes, insight, exposed, composed, properties, territories", "int frames_posed;",
                     "std::tie(a, b) = f();", "// the file beside it", 'error("no images beside it");',
                     "report.stages[\"resect\"]"):
            self.assertEqual(list(retired_words(".cpp", text)), [], text)
        self.assertEqual(list(retired_words(".py", '"""The file beside it."""  # beside\n')), [])
        self.assertEqual(list(retired_words(".md", "a file beside the images")), [])


if __name__ == "__main__":
    rosunit.unitrun(PACKAGE, "check_terms", TermsTest, sysargs=sys.argv)
