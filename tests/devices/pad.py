"""A gamepad through the kernel's uinput: an Xbox 360 pad on USB, as the driver xpad presents it."""
import fcntl
import os
import struct

UI_SET_EVBIT, UI_SET_KEYBIT, UI_DEV_CREATE, UI_DEV_DESTROY = 0x40045564, 0x40045565, 0x5501, 0x5502
UI_DEV_SETUP, UI_ABS_SETUP = 0x405C5503, 0x401C5504
EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
BUTTONS = {"a": 0x130, "b": 0x131, "x": 0x133, "y": 0x134, "left shoulder": 0x136, "right shoulder": 0x137, "back": 0x13A, "start": 0x13B,
           "guide": 0x13C, "left stick": 0x13D, "right stick": 0x13E}
AXES = {"left x": 0, "left y": 1, "left trigger": 2, "right x": 3, "right y": 4, "right trigger": 5, "cross x": 16, "cross y": 17}
FULL = 32767


class Pad:
    """A gamepad that is connected until unplug()."""

    def __init__(self):
        self._file = os.open("/dev/uinput", os.O_WRONLY | os.O_NONBLOCK)
        for kind in (EV_KEY, EV_ABS):
            fcntl.ioctl(self._file, UI_SET_EVBIT, kind)
        for code in BUTTONS.values():
            fcntl.ioctl(self._file, UI_SET_KEYBIT, code)
        for name, code in AXES.items():
            least, most = (0, 255) if "trigger" in name else (-1, 1) if "cross" in name else (-FULL - 1, FULL)
            fcntl.ioctl(self._file, UI_ABS_SETUP, struct.pack("Hxxiiiiii", code, 0, least, most, 0, 0, 0))
        fcntl.ioctl(self._file, UI_DEV_SETUP, struct.pack("HHHH80sI", 3, 0x045E, 0x028E, 0x110, b"Microsoft X-Box 360 pad", 0))
        fcntl.ioctl(self._file, UI_DEV_CREATE)

    def _event(self, kind: int, code: int, value: int) -> None:
        os.write(self._file, struct.pack("llHHi", 0, 0, kind, code, value) + struct.pack("llHHi", 0, 0, EV_SYN, 0, 0))

    def press(self, button: str, down: bool = True) -> None:
        self._event(EV_KEY, BUTTONS[button], int(down))

    def push(self, axis: str, share: float) -> None:
        """From -1 to 1; forward and left are negative, as in the kernel."""
        self._event(EV_ABS, AXES[axis], round(share * FULL))

    def unplug(self) -> None:
        fcntl.ioctl(self._file, UI_DEV_DESTROY)
        os.close(self._file)
