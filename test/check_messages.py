#!/usr/bin/python3
"""All texts that the programs and nodelets print, in one file to read: messages.txt next to this test. `check_messages.py --write`
writes it again after a change. {} stands for a value, %d and the like as in printf."""
import pathlib
import re
import sys
import unittest

PACKAGE = "mono_pose_tracker"
REPOSITORY = pathlib.Path(__file__).resolve().parent.parent
SNAPSHOT = REPOSITORY / "test" / "messages.txt"
NOT_PRINTED = {"benchmarks"}  # folders of src: not installed
LEAST_WORDS = 3  # fewer are keys, names and formats

TOKEN = re.compile(r"""
    (?P<comment>//[^\n]*|/\*.*?\*/)
  | (?P<raw>R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)")
  | (?P<preprocessor>^[ \t]*\#[^\n]*(?:\\\n[^\n]*)*)
  | (?P<text>"(?:[^"\\\n]|\\.)*")
  | (?P<character>'(?:[^'\\\n]|\\.)+')
  | (?P<other>::|->|\w+|\S)
""", re.VERBOSE | re.DOTALL | re.MULTILINE)
ESCAPES = {"\\n": "\n", "\\t": "\t", '\\"': '"', "\\\\": "\\", "\\'": "'"}


def tokens(source):
    """(is a string, its text or the token), without comments, raw strings (pages and shaders) and preprocessor lines."""
    for match in TOKEN.finditer(source):
        if match["text"] is not None:
            yield True, re.sub(r"\\.", lambda e: ESCAPES.get(e[0], e[0]), match["text"][1:-1])
        elif match["character"] or match["other"]:
            yield False, match[0]


def end_of_value(found, at):
    """Where the value added by the `+` at this place ends: at the next `+`; None where nothing is added after it."""
    depth = 0
    for i in range(at + 1, len(found)):
        is_text, token = found[i]
        if is_text and depth == 0:
            return None if i > at + 1 else at
        if token in ("(", "[", "{") and not is_text:
            depth += 1
        elif token in (")", "]", "}", ";", ",", "?", ":") and not is_text and depth == 0:
            return None
        elif token in (")", "]", "}") and not is_text:
            depth -= 1
        elif token == "+" and not is_text and depth == 0:
            return i
    return None


def messages(source):
    """Adjacent literals and those joined by + are one text."""
    found, result, i = list(tokens(source)), [], 0
    while i < len(found):
        if not found[i][0]:
            i += 1
            continue
        text = ""
        while i < len(found):
            if found[i][0]:
                text += found[i][1]
                i += 1
                continue
            end = end_of_value(found, i) if found[i][1] == "+" and not found[i][0] else None
            if end is None:
                break
            text += "" if end == i else "{}"
            i = end + 1 if end == i or found[end + 1][0] else end
        result.append(text)
    return result


def is_message(text):
    return len(re.findall(r"[A-Za-z]{2,}", text)) >= LEAST_WORDS and " " in text.strip()


def snapshot():
    lines = ["Texts that are printed, by file (check_messages.py --write). {}: a value."]
    for path in sorted((REPOSITORY / "src").rglob("*.cpp")):
        name = path.relative_to(REPOSITORY)
        if name.parts[1] in NOT_PRINTED:
            continue
        texts = list(dict.fromkeys(t for t in messages(path.read_text()) if is_message(t)))
        if texts:
            lines += ["", str(name)] + ["    " + t.strip().replace("\n", "\n        ") for t in texts]
    return "\n".join(lines) + "\n"


class MessagesTest(unittest.TestCase):
    def test_all_texts_are_in_the_file(self):
        self.maxDiff = None
        self.assertEqual(SNAPSHOT.read_text().splitlines(), snapshot().splitlines(), "test/check_messages.py --write")

    def test_literals_and_values_are_joined(self):
        source = '''f("a b" " c" + std::to_string(n) + " d", "x");  // "no"\ng(x + "one two " + y(1, "z") + "; three");'''
        self.assertEqual(messages(source), ["a b c{} d", "x", "one two {}; three"])


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        SNAPSHOT.write_text(snapshot())
    else:
        import rosunit
        rosunit.unitrun(PACKAGE, "check_messages", MessagesTest, sysargs=sys.argv)
