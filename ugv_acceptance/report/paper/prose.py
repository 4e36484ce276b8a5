"""The texts of the paper's page between its tables and pictures."""


def _paragraphs(text: str) -> tuple[str, ...]:
    return tuple(' '.join(part.split()) for part in text.strip().split('\n\n'))


WORST_CASE = _paragraphs("""
Equation (3): the extrema of both torques lie at sin(θ₁ + θ₂) = 0. Link 2 then points to the side to
which link 1 leans; upright, to either side. For any other robot a static torque over one joint is
c + R cos(q - phase), three numbers that three postures tell, with the same question and answer.

The level, stretched arm with 4 kg needs 74.8 N m at joint 1 and 33.0 N m at joint 2: joint 1 is
above every threshold that the paper uses.

Equations (5) to (8) bound only +T. A motor fails at -T as well. The table gives the safe θ₂ at
T₁ = T₂ = 30 N m in both readings; they differ wherever a torque reaches -30 N m.
""")

(FIGURE_4,) = _paragraphs("""
Static torque by equations (1) and (2); dynamic torque by the recursive Newton-Euler algorithm, with
the centres of gravity that give Table 2. At 7.2°/s the motion itself adds 0.03 N m at most; what is
seen between line and marks is the offset of the centres of gravity.
""")

MULTI_BODY = _paragraphs("""
What the paper took from ADAMS: forces, torque, rate and acceleration at each joint, here of the
whole robot in MuJoCo. The elbow turns once at 7.2°/s, the shoulder is at 30°, flippers forward. A
cell gives the least and the largest value; the force is what the parent link exerts on the child.
""")

STATISTICS = _paragraphs("""
All 16 cells follow from rigid-body dynamics once the links' centres of gravity are not at mid-link.
The offsets that give every cell form two narrow bands: link 2 by {second_low:.2f} to
{second_high:.2f} mm and link 1 by {low:.2f} to {high:.2f} mm, or by {mirror_low:.2f} to
{mirror_high:.2f} mm. For one offset of link 2, that of link 1 may vary by 0.015 mm at most. The
page uses {first:.2f} and {second:.2f} mm.

What this means: the paper's ADAMS model "accounts for all center of gravity locations", its
static model puts them at mid-link. The reference error at 1°/s is therefore a difference at
rest: 1.0 N m at joint 1 (47 mm, 2.5 kg, cos 30°) and 0.04 N m at joint 2. Joint 2 feels nothing
of a constant rate of its own, so its F is 1.0 at every speed. The offsets are a fit, not a
measurement: any error at rest of that size and shape gives the same table.

A flaw of the statistic: with both centres of gravity at mid-link the reference error is nearly zero
and F = (speed / 1°/s)⁴, without bound. F compares the motion with whatever else is wrong with the
static model: the worse the model, the faster the robot may move. The verb speed therefore asks for
the static model's own error in N m.

The paper calls every speed up to 36°/s acceptable. With its own critical value that does not hold:
1.2 in Table 2 is a rounded value above 1.227. With the critical value computed for 5 % it does.
""")

ROLLOVER = _paragraphs("""
The paper omits the platform; its numbers here come from public sources and carry their uncertainty
in the URDF. The shoulder's place on the deck is assumed.

On level ground at full forward reach with {load:g} kg the robot has {stowed:.1f}° of tilt left with
stowed flippers, and {forward:.1f}° with flippers forward. Negative means that it tips on the level.
""")

CAPABILITY = _paragraphs("""
The further tests that the paper names. Each bound is exact: torques and tipping moments are linear
in the force, friction is a quadratic. The load hangs at the gripper. The friction of 0.7 and the
hitch, at the rear and 0.095 m high, are assumed.
""")
