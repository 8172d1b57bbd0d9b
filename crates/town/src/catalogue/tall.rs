//! The silhouettes of tall vehicles: vans, buses, cabs of trucks, off-road cars.

use crate::catalogue::profile::{
    Silhouette,
    Skin::{Paint, Pane},
};

const PLAN: &[(f32, f32)] = &[
    (0.0, 0.84),
    (0.012, 0.92),
    (0.04, 0.97),
    (0.12, 1.0),
    (0.93, 1.0),
    (0.985, 0.975),
    (1.0, 0.95),
];

/// A panel van with a high roof.
pub(super) const VAN: Silhouette = Silhouette {
    top: &[
        (0.0, 0.3, Paint),
        (0.01, 0.375, Paint),
        (0.05, 0.425, Paint),
        (0.135, 0.49, Pane),
        (0.235, 0.86, Paint),
        (0.28, 0.955, Paint),
        (0.36, 0.99, Paint),
        (0.6, 1.0, Paint),
        (0.95, 0.99, Paint),
        (0.985, 0.975, Paint),
        (1.0, 0.94, Paint),
    ],
    belt: &[(0.0, 0.26), (0.02, 0.345), (0.13, 0.465), (0.25, 0.5), (0.97, 0.5), (1.0, 0.5)],
    plan: PLAN,
    roof: 0.885,
    windows: (0.2585, 0.355),
    pillars: &[],
    mirror: 0.225,
    clearance_m: 0.2,
    doors: 2,
    is_angular: false,
    cage: include_str!("cages/van.obj"),
};

/// A forward-control van with windows all round.
pub(super) const MICROBUS: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Paint),
        (0.012, 0.45, Paint),
        (0.035, 0.545, Pane),
        (0.1, 0.86, Paint),
        (0.14, 0.95, Paint),
        (0.22, 0.99, Paint),
        (0.6, 1.0, Paint),
        (0.9, 0.985, Paint),
        (0.95, 0.91, Pane),
        (0.985, 0.62, Paint),
        (1.0, 0.5, Paint),
    ],
    belt: &[(0.0, 0.32), (0.02, 0.45), (0.06, 0.52), (0.9, 0.535), (0.98, 0.53), (1.0, 0.45)],
    plan: PLAN,
    roof: 0.82,
    windows: (0.0955, 0.93),
    pillars: &[0.266, 0.48, 0.7],
    mirror: 0.1,
    clearance_m: 0.2,
    doors: 2,
    is_angular: false,
    cage: include_str!("cages/microbus.obj"),
};

/// A coach with a windscreen across the whole front.
pub(super) const COACH: Silhouette = Silhouette {
    top: &[
        (0.0, 0.3, Paint),
        (0.006, 0.36, Paint),
        (0.012, 0.4, Pane),
        (0.045, 0.83, Paint),
        (0.06, 0.93, Paint),
        (0.1, 0.985, Paint),
        (0.5, 1.0, Paint),
        (0.955, 0.99, Paint),
        (0.972, 0.9, Pane),
        (0.99, 0.54, Paint),
        (1.0, 0.42, Paint),
    ],
    belt: &[(0.0, 0.28), (0.01, 0.38), (0.06, 0.42), (0.97, 0.42), (1.0, 0.38)],
    plan: PLAN,
    roof: 0.95,
    windows: (0.045, 0.95),
    pillars: &[0.13, 0.25, 0.37, 0.49, 0.61, 0.73, 0.845],
    mirror: 0.03,
    clearance_m: 0.28,
    doors: 0,
    is_angular: false,
    cage: include_str!("cages/coach.obj"),
};

/// A forward-control cab.
pub(super) const CAB: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Paint),
        (0.02, 0.42, Paint),
        (0.05, 0.46, Pane),
        (0.2, 0.86, Paint),
        (0.28, 0.955, Paint),
        (0.45, 0.995, Paint),
        (0.9, 1.0, Paint),
        (1.0, 0.99, Paint),
    ],
    belt: &[(0.0, 0.34), (0.03, 0.42), (0.15, 0.47), (1.0, 0.47)],
    plan: &[(0.0, 0.86), (0.04, 0.94), (0.15, 1.0), (0.96, 1.0), (1.0, 0.985)],
    roof: 0.92,
    windows: (0.169, 0.745),
    pillars: &[],
    mirror: 0.12,
    clearance_m: 0.34,
    doors: 2,
    is_angular: false,
    cage: include_str!("cages/cab.obj"),
};

/// A cab with a bonnet, as on vans.
pub(super) const SNOUT: Silhouette = Silhouette {
    top: &[
        (0.0, 0.4, Paint),
        (0.03, 0.49, Paint),
        (0.12, 0.555, Paint),
        (0.36, 0.61, Pane),
        (0.6, 0.94, Paint),
        (0.7, 0.99, Paint),
        (0.85, 1.0, Paint),
        (1.0, 1.0, Paint),
    ],
    belt: &[(0.0, 0.36), (0.05, 0.47), (0.36, 0.565), (1.0, 0.58)],
    plan: &[(0.0, 0.76), (0.03, 0.86), (0.12, 0.95), (0.35, 1.0), (0.97, 1.0), (1.0, 0.985)],
    roof: 0.86,
    windows: (0.62, 0.86),
    pillars: &[],
    mirror: 0.6,
    clearance_m: 0.24,
    doors: 2,
    is_angular: false,
    cage: include_str!("cages/snout.obj"),
};

/// A tall off-road car with upright panes.
pub(super) const OFF_ROADER: Silhouette = Silhouette {
    top: &[
        (0.0, 0.46, Paint),
        (0.01, 0.56, Paint),
        (0.04, 0.6, Paint),
        (0.26, 0.63, Paint),
        (0.29, 0.64, Pane),
        (0.355, 0.94, Paint),
        (0.38, 0.985, Paint),
        (0.6, 1.0, Paint),
        (0.94, 0.99, Paint),
        (0.955, 0.96, Pane),
        (0.985, 0.68, Paint),
        (1.0, 0.54, Paint),
    ],
    belt: &[(0.0, 0.44), (0.02, 0.54), (0.26, 0.6), (0.97, 0.62), (1.0, 0.5)],
    plan: PLAN,
    roof: 0.86,
    windows: (0.3335, 0.94),
    pillars: &[0.4935, 0.692],
    mirror: 0.335,
    clearance_m: 0.26,
    doors: 4,
    is_angular: false,
    cage: include_str!("cages/off_roader.obj"),
};

/// A jeep: flat bonnet, upright windscreen, straight sides.
pub(super) const JEEP: Silhouette = Silhouette {
    top: &[
        (0.0, 0.5, Paint),
        (0.008, 0.585, Paint),
        (0.02, 0.6, Paint),
        (0.325, 0.625, Paint),
        (0.335, 0.635, Pane),
        (0.385, 0.945, Paint),
        (0.4, 0.985, Paint),
        (0.6, 1.0, Paint),
        (0.945, 0.99, Paint),
        (0.965, 0.96, Pane),
        (0.985, 0.66, Paint),
        (1.0, 0.56, Paint),
    ],
    belt: &[(0.0, 0.47), (0.02, 0.57), (0.33, 0.6), (0.97, 0.61), (1.0, 0.52)],
    plan: &[
        (0.0, 0.74),
        (0.02, 0.8),
        (0.18, 0.88),
        (0.32, 0.98),
        (0.36, 1.0),
        (0.985, 0.99),
        (1.0, 0.97),
    ],
    roof: 0.9,
    windows: (0.369, 0.945),
    pillars: &[0.587],
    mirror: 0.37,
    clearance_m: 0.3,
    doors: 2,
    is_angular: false,
    cage: include_str!("cages/jeep.obj"),
};
