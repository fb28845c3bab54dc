"""For tests: threads whose failures are not lost."""
import threading

import feeding


class Background(threading.Thread):
    """A thread whose failure fails the test that joins it."""

    def __init__(self, function, *arguments):
        super().__init__()
        self.function, self.arguments, self.error = function, arguments, None
        self.start()

    def run(self):
        try:
            self.function(*self.arguments)
        except BaseException as error:  # whatever it is: join raises it
            self.error = error

    def join(self, timeout=feeding.TIMEOUT):
        super().join(timeout)
        if self.is_alive():
            raise AssertionError("a thread hangs")
        if self.error is not None:
            raise self.error


class Stream:
    """Images at a rate that may be more than is taken, each later than the one before, from a thread of its own, until
    stop()."""

    def __init__(self, camera, images, period=0.01):
        self.camera, self.source, self.period, self.sent = camera, images, period, 0
        self.stopped = threading.Event()
        self.thread = Background(self.run)

    def run(self):
        while not self.stopped.wait(self.period):
            image = feeding.moved(self.source[self.sent % len(self.source)], 10.0 * (self.sent // len(self.source)))
            self.camera.info.header = image.header
            self.camera.infos.publish(self.camera.info)
            self.camera.images.publish(image)
            self.sent += 1

    def stop(self):
        self.stopped.set()
        self.thread.join()
