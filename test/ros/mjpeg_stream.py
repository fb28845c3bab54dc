"""A camera of the network for tests: images over HTTP, as JPEG files one after the other (multipart/x-mixed-replace)."""
import http.server
import socket
import threading
import time

import cv2


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class MjpegStream:
    """Sends the images at the given rate to each client, again and again, from its making until close()."""

    def __init__(self, port, images, rate):
        parts = []
        for image in images:
            jpeg = cv2.imencode(".jpg", image)[1].tobytes()
            parts.append(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (len(jpeg), jpeg))
        closed = self.closed = threading.Event()

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                try:
                    self.send_images()
                except OSError:
                    pass  # the client has gone

            def send_images(self):
                due = time.monotonic()
                while True:
                    for part in parts:
                        if closed.wait(max(0, due - time.monotonic())):
                            return
                        due += 1 / rate
                        self.wfile.write(part)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.closed.set()
        self.server.shutdown()
        self.server.server_close()
