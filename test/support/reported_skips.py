"""For tests that may be skipped: rosunit's JUnit files count those as passed. Once this is imported, they say that a test
was skipped, and why."""
from xml.etree import ElementTree

from rosunit import xmlrunner


class SkippedTest(xmlrunner._TestInfo):
    def __init__(self, test, reason):
        super().__init__(test, 0)
        self.reason = reason

    def xml(self):
        case = super().xml()
        ElementTree.SubElement(case, "skipped").set("message", self.reason)
        return case

    def print_report_text(self, stream):
        stream.write(f"[Testcase: {self._method}] ... skipped: {self.reason}\n")


class Result(xmlrunner._XMLTestResult):
    def startTest(self, test):
        self.skipped_because = None
        super().startTest(test)

    def addSkip(self, test, reason):
        self.skipped_because = reason
        super().addSkip(test, reason)

    def stopTest(self, test):
        super().stopTest(test)
        if self.skipped_because is not None:
            self._tests[-1] = SkippedTest(test, self.skipped_because)


xmlrunner._XMLTestResult = Result
