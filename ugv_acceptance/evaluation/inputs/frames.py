"""Names of frames: when the frame that a message names is the one that is expected."""


def same_frame(named: str, expected: str) -> bool:
    """Return whether a frame is the one expected; a namespace (tf prefix) may precede its name.

    `/gripper_link` and `ra/gripper_link` are both the frame `gripper_link`; '' is no frame's name.
    """
    bare = named.lstrip('/')
    return bare == expected or bare.endswith(f'/{expected}')
