"""Tandem's robots behind the interfaces of a Unitree G1: DDS topics and RPC services, LeRobot's and teleimager's sockets.

    python -m tandem_unitree --task handover --seed 0

Programs written for a G1 then drive robot A in DDS domain 1 and robot B in domain 2, both on the interface `lo`. The package
needs the extra `unitree` of the wheel: `pip install tandem-sim[unitree]`.
"""
