"""teleimager's client asks robot A for its cameras and receives pictures."""

import os
import tempfile
import time

os.environ["XDG_CONFIG_HOME"] = tempfile.mkdtemp()

from teleimager.client import TeleImageClient

ADDRESS = "127.0.0.2"

print(TeleImageClient.scan(ADDRESS, 60000))
client = TeleImageClient("head_camera", server_host=ADDRESS, zmq_port=55555, request_bgr=True)
last, begun_s = None, time.time()
while time.time() - begun_s < 4:
    frame = client.get_frame()
    if frame and frame.bgr is not None:
        last = frame
    time.sleep(1 / 30)
assert last is not None and last.bgr.shape == (480, 640, 3) and last.bgr.mean() > 5
print("fine", flush=True)
# The client's threads do not end.
os._exit(0)
