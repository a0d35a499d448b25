"""What the components file may say: the kinds of components and the catalogue numbers of each."""

from __future__ import annotations

from ksl.sizing.bearings import ANGULAR_CONTACT
from ksl.sizing.bolt_strength import MODULI, THREADS_IN, TIGHTENING
from ksl.sizing.catalogue.catalogue_key import Key as Key
from ksl.sizing.catalogue.catalogue_key import ComponentKind as ComponentKind
from ksl.sizing.catalogue.catalogue_pins import BUSH, CYLINDER, PIN
from ksl.sizing.catalogue.catalogue_stiffness import AXIAL, CLASSES, INTERFACE, RADIAL, TILTING, TORSION
from ksl.sizing.fatigue import BELOW_KNEES, MEAN_STRESSES, RESIDUES

LIFE = (
    Key("required_life_h", "h", "life that is asked for; otherwise that at the top of the file", "20000"),
    Key("reliability", "%", "of the life: 90, 95, 96, 97, 98 or 99; otherwise that at the top of the file", "90"),
)
RATINGS = (Key("C", "N", "basic dynamic load rating", "12000"), Key("C0", "N", "basic static load rating", "9000"))
DEEP_GROOVE_KEYS = (Key("f0", "", "factor of the relative axial load; of deep-groove bearings", "13"),)
ANGLES = tuple(float(a) for a in ANGULAR_CONTACT)
CONTACT = Key("contact_angle_deg", "°", "20, 25, 30, 35, 40 or 45", "40", default=40.0, one_of=ANGLES)
POSITION = Key("position", "m", "on the joint's axis, from its origin", "0.02", sign="any", needed=True)
SAFETY = Key("required_static_safety", "", "smallest C0/P0 that is accepted", "1.5", default=1.0)

BEARING = (
    Key(
        "type",
        "",
        "deep groove, or angular contact pair: two rows taken as one bearing with C and C0 of the pair",
        '"deep groove"',
        "word",
        choices=("deep groove", "angular contact pair"),
        needed=True,
    ),
    POSITION,
    *RATINGS,
    *DEEP_GROOVE_KEYS,
    CONTACT,
    SAFETY,
    AXIAL,
    RADIAL,
)
ROW = (
    Key("position", "m", "where its contact lines meet the joint's axis, from the joint's origin", "0.02", sign="any", needed=True),
    *RATINGS,
    SAFETY,
    RADIAL,
)

SIDE = Key(
    "on",
    "",
    "the link that it is fixed to: child, or parent for what stays while the joint moves; `at` and directions are then in the parent's axes",
    '"child"',
    "word",
    default="child",
    choices=("child", "parent"),
)

MOTOR = ComponentKind(
    "motor",
    "motor and drive, numbers at the rotor's shaft",
    "driven",
    (
        Key("rotor_inertia", "kg m²", "of rotor, brake, encoder and the gear's input", "2.6e-5", sign="not negative"),
        Key("gear_ratio", "", "turns of the rotor for each of the joint (rad/m where it slides); otherwise that of the gear on the joint", "100"),
        Key("gear_efficiency", "", "0 to 1; otherwise that of the gear on the joint, or 1", "0.8", largest=1.0),
        Key("rated_torque", "N m", "continuous (S1) torque, compared with the rms torque", "0.45"),
        Key("peak_torque", "N m", "of motor and drive together", "1.6"),
        Key("max_speed_rpm", "r/min", "of motor and drive", "6000"),
        Key("max_power", "W", "of the drive, positive or negative", "400"),
        Key("torque_speed", "r/min, N m", "curve of peak torque over speed", "[[0, 1.6], [3500, 1.6], [6000, 0.5]]", "curve"),
        Key("continuous_torque_speed", "r/min, N m", "curve of continuous torque over speed", "[[0, 0.5], [6000, 0.3]]", "curve"),
        Key("regenerated_energy", "J", "that the drive can take up during one pass through all cases", "20"),
        Key("brake_torque", "N m", "static, of the holding brake at the rotor", "1.0"),
    ),
)
STRAIN_WAVE = ComponentKind(
    "strain wave gear",
    "harmonic drive; torques at the output, speeds at the input",
    "turning",
    (
        Key("ratio", "", "turns of the input for one of the output", "100"),
        Key("efficiency", "", "0 to 1, for the motor on the same joint", "0.75", largest=1.0),
        Key("rated_torque", "N m", "at the rated input speed", "67"),
        Key("rated_input_rpm", "r/min", "input speed of the rated torque", "2000", default=2000.0),
        Key("rated_life_h", "h", "L10 at the rated torque: 7000 (CSF, SHF), 10000 (CSG, SHG)", "7000", default=7000.0),
        Key("average_torque", "N m", "limit of the average torque", "108"),
        Key("repeated_peak_torque", "N m", "limit for starts and stops of the cycle", "157"),
        Key("momentary_peak_torque", "N m", "limit for emergencies", "284"),
        Key("max_input_rpm", "r/min", "limit of the input speed, with the lubricant that is used", "5600"),
        Key("max_average_input_rpm", "r/min", "limit of the average input speed", "3500"),
        *CLASSES,
        LIFE[0],
    ),
)
PLANETARY = ComponentKind(
    "planetary gear",
    "torques at the output, speeds at the input",
    "turning",
    (
        Key("ratio", "", "turns of the input for one of the output", "50"),
        Key("efficiency", "", "0 to 1, for the motor on the same joint", "0.94", largest=1.0),
        Key("nominal_torque", "N m", "T2N, compared with the mean torque", "40"),
        Key("acceleration_torque", "N m", "T2B, for the peaks of the cycle", "80"),
        Key("emergency_torque", "N m", "T2Not, for emergencies", "120"),
        Key("nominal_input_rpm", "r/min", "n1N, compared with the mean speed", "3000"),
        Key("max_input_rpm", "r/min", "limit of the input speed", "6000"),
        Key("torque_exponent", "", "of the mean torque, as the gear's catalogue has it", "3", default=3.0, largest=100.0),
        *TORSION,
    ),
)
CROSSED_ROLLER = ComponentKind(
    "crossed roller bearing",
    "carries axial and radial force and the tilting moment about the pitch plane of its rollers",
    "turning",
    (
        Key("position", "m", "of the pitch plane on the joint's axis, from its origin", "0.0", sign="any", default=0.0),
        Key("pitch_diameter", "m", "of the rollers, dp", "0.1"),
        *RATINGS,
        Key("load_factor", "", "fw: 1 to 1.2 smooth, 1.2 to 1.5 normal, 1.5 to 3 with impacts", "1.2", default=1.2),
        Key("required_static_safety", "", "smallest C0/P0 that is accepted", "2", default=2.0),
        AXIAL,
        RADIAL,
        TILTING,
        *LIFE,
    ),
)
PAIR = ComponentKind(
    "bearing pair",
    "two bearings on the joint's axis; the locating one carries the axial force",
    "turning",
    (
        Key("locating", "", "the bearing that carries the axial force", "", "table", keys=BEARING, needed=True),
        Key("floating", "", "the bearing that can move along the axis", "", "table", keys=BEARING, needed=True),
        *LIFE,
    ),
)
OPPOSED = ComponentKind(
    "opposed angular contact bearings",
    "two single rows against each other, without preload",
    "turning",
    (
        Key("arrangement", "", "back-to-back (O) or face-to-face (X)", '"back-to-back"', "word", choices=("back-to-back", "face-to-face"), needed=True),
        Key("shaft", "", "which link carries the inner rings: child or parent", '"child"', "word", default="child", choices=("child", "parent")),
        CONTACT,
        Key("a", "", "one of the two", "", "table", keys=ROW, needed=True),
        Key("b", "", "the other one", "", "table", keys=ROW, needed=True),
        AXIAL,
        *LIFE,
    ),
)
FLANGE = ComponentKind(
    "bolted flange",
    "of a fixed joint, of `base`, or between a gear and a link; preloaded bolts by VDI 2230",
    "any",
    (
        Key("bolts", "", "number of bolts on a circle", "8", "count", alternative=True),
        Key("circle_diameter", "m", "of the bolt circle", "0.125", alternative=True),
        Key("first_angle_deg", "°", "of the first bolt, from x_axis", "0", sign="any", default=0.0),
        Key(
            "points",
            "m",
            "instead of a circle: each bolt's coordinates in the flange, from `at`",
            "[[0.05, 0.05], [-0.05, 0.05], [-0.05, -0.05], [0.05, -0.05]]",
            "points",
            sign="any",
        ),
        Key("at", "m", "centre of the flange, from the joint's origin in its axes", "[0, 0, 0]", "vector", sign="any", default=[0.0, 0.0, 0.0]),
        SIDE,
        Key(
            "normal",
            "",
            "along the bolts, from the parent's side to the child's; otherwise the joint's axis, z for fixed joints",
            "[0, 0, 1]",
            "vector",
            sign="any",
        ),
        Key("x_axis", "", "direction of x in the flange", "[1, 0, 0]", "vector", sign="any"),
        Key("bolt", "", "thread and property class of ISO 898-1: gives all that follows up to amplitude_limit, unless that is given", '"M8 8.8"', "word"),
        Key("clamp_length", "m", "l_K: thickness that the bolt clamps, from the head to the tapped plate or the nut", "0.02"),
        Key("shank_length", "m", "how much of it has no thread", "0", sign="not negative", default=0.0),
        Key("plates", "", f"what is clamped: {', '.join(MODULI)}", '"aluminium"', "word", choices=tuple(MODULI)),
        Key("thread_in", "", "where the bolt is held: a tapped plate, or a nut", '"plate"', "word", default="plate", choices=THREADS_IN),
        Key(
            "tightening",
            "",
            f"method, which gives the tightening factor: {'; '.join(f'{way} {alpha:g}' for way, alpha in TIGHTENING.items())}",
            '"torque wrench"',
            "word",
            default="torque wrench",
            choices=tuple(TIGHTENING),
        ),
        Key("thread_friction", "", "μ_G, the smallest", "0.12", default=0.12, largest=1.0),
        Key("yield_share", "", "ν: of the yield strength, that tightening uses", "0.9", default=0.9, largest=1.0),
        Key("preload", "N", "smallest assembly preload F_M of one bolt", "9000"),
        Key("tightening_factor", "", "α_A: largest over smallest preload", "1.6", default=1.6),
        Key("embedding_loss", "N", "F_Z", "800", sign="not negative", default=0.0),
        Key("bolt_resilience", "m/N", "δ_S", "4.2e-9"),
        Key("plate_resilience", "m/N", "δ_P", "1.1e-9"),
        Key("load_introduction", "", "n, at most 1", "0.5", default=1.0, largest=1.0),
        Key("load_factor", "", "Φ itself, instead of the three above", "0.1", largest=1.0),
        Key("yield_force", "N", "of one bolt, F_0.2 with the share that tightening leaves", "16000"),
        Key("amplitude_limit", "N", "fatigue: largest force amplitude of one bolt", "800"),
        Key("required_clamp", "N", "clamp force that must be left at each bolt, for a seal for instance", "500", sign="not negative", default=0.0),
        Key("friction", "", "μ_T in the interface", "0.14"),
        Key("interfaces", "", "q_F, that carry the shear load", "1", default=1.0),
        *INTERFACE,
    ),
)
FATIGUE = ComponentKind(
    "fatigue",
    "rainflow count of a stress that is a sum of components of the wrench, and Miner's sum",
    "any",
    (
        Key(
            "stress",
            "the stress's per N or N m",
            "factors of fx fy fz tx ty tz (in the joint's axes, on the child) and effort",
            "{ tx = 2.1e5, fz = 900 }",
            "numbers by name",
            sign="any",
            needed=True,
        ),
        Key("unit", "", "of the stress", '"Pa"', "word", default="Pa"),
        Key("at", "m", "point of the moments, from the joint's origin in its axes", "[0, 0, 0]", "vector", sign="any", default=[0.0, 0.0, 0.0]),
        SIDE,
        Key("k", "", "slope of the S–N line", "5", largest=100.0),
        Key("knee_amplitude", "the stress's", "S_k", "60e6"),
        Key("knee_cycles", "", "N_k", "2e6"),
        Key(
            "below_knee", "", "elementary: the same slope; haibach: 2k − 1; original: no damage", '"haibach"', "word", default="elementary", choices=BELOW_KNEES
        ),
        Key(
            "mean_stress",
            "",
            "none, goodman, or goodman in tension: without credit for compression",
            '"goodman"',
            "word",
            default="none",
            choices=MEAN_STRESSES,
        ),
        Key("ultimate", "the stress's", "S_u, for Goodman", "600e6"),
        Key(
            "residue",
            "",
            "half cycles (ASTM 5.4.4), or repeating: each case repeats, all its cycles close (5.4.5)",
            '"half cycles"',
            "word",
            default="half cycles",
            choices=RESIDUES,
        ),
        Key("required_repetitions", "", "of one pass through all cases", "1e6"),
        LIFE[0],
    ),
)
LIMITS = ComponentKind(
    "limits",
    "plain limits of an actuator, a bearing or a section: magnitudes over all cases",
    "any",
    (
        Key("at", "m", "point of the moments, from the joint's origin in its axes", "[0, 0, 0]", "vector", sign="any", default=[0.0, 0.0, 0.0]),
        SIDE,
        Key("axial_force", "N", "along the axis (z for fixed joints)", "3000"),
        Key("radial_force", "N", "across the axis", "2000"),
        Key("bending_moment", "N m", "across the axis", "150"),
        Key("torque", "N m", "about the axis", "90"),
        Key("speed_rpm", "r/min", "of the joint", "25"),
    ),
)

KINDS = {k.name: k for k in (MOTOR, STRAIN_WAVE, PLANETARY, CROSSED_ROLLER, PAIR, OPPOSED, FLANGE, PIN, BUSH, CYLINDER, FATIGUE, LIMITS)}
COMMON = ("kind", "name", "joint", "joints")
