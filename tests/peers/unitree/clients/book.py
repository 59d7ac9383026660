"""The program of the book's page `unitree.md` runs unchanged. At its end the waist has turned.

`run.py` starts it with the DDS domain of the robot.
"""

import re
import sys
import time
from pathlib import Path

PAGE = Path(__file__).resolve().parents[4] / "docs" / "src" / "unitree.md"

[program] = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
sys.argv = ["program.py", "lo", sys.argv[1]]
names = {"__name__": "__main__"}
exec(compile(program, str(PAGE), "exec"), names)
time.sleep(0.5)
yaw = [state.motor_state[names["WAIST_YAW"]].q for state in (names["latest"][0], names["latest"][-1])]
print(f"the waist turns from {yaw[0]:.3f} to {yaw[1]:.3f} rad")
assert abs(yaw[1] - yaw[0] - 0.3) < 0.02
print("fine")
