//! The coarse class of an instance where there are no classes: a body or a kind of background.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The body of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// On foot.
    Person,
    /// Bicycle or motorcycle, with or without a rider.
    TwoWheeler,
    /// Car or van.
    Car,
    /// Truck, bus, tram.
    LargeVehicle,
}

impl Body {
    /// All bodies in their order.
    pub const ALL: [Body; 4] = [Body::Person, Body::TwoWheeler, Body::Car, Body::LargeVehicle];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Body::Person => "person",
            Body::TwoWheeler => "two-wheeler",
            Body::Car => "car",
            Body::LargeVehicle => "large vehicle",
        }
    }
}

/// A coarse class: what can be told without a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CoarseClass {
    /// An object.
    Body(Body),
    /// Pole, post, trunk.
    Pole,
    /// Building, wall, fence.
    Structure,
    /// Leaves, branches.
    Vegetation,
    /// None of these, or too few points to tell.
    Unknown,
}

impl CoarseClass {
    /// All classes in their order.
    pub const ALL: [CoarseClass; 8] = [
        CoarseClass::Body(Body::Car),
        CoarseClass::Body(Body::Person),
        CoarseClass::Body(Body::TwoWheeler),
        CoarseClass::Body(Body::LargeVehicle),
        CoarseClass::Pole,
        CoarseClass::Structure,
        CoarseClass::Vegetation,
        CoarseClass::Unknown,
    ];

    /// Whether it is a class of objects; the others are background.
    pub fn is_object(self) -> bool {
        matches!(self, CoarseClass::Body(_))
    }

    /// Its name as boxes show it.
    pub fn name(self) -> &'static str {
        match self {
            CoarseClass::Body(Body::Car) => "vehicle-like",
            CoarseClass::Body(Body::Person) => "person-like",
            CoarseClass::Body(Body::TwoWheeler) => "two-wheeler-like",
            CoarseClass::Body(Body::LargeVehicle) => "large-vehicle-like",
            CoarseClass::Pole => "pole-like",
            CoarseClass::Structure => "structure",
            CoarseClass::Vegetation => "vegetation-like",
            CoarseClass::Unknown => "unknown",
        }
    }

    /// Its name in JSON.
    fn key(self) -> &'static str {
        match self {
            CoarseClass::Body(Body::Car) => "vehicle",
            CoarseClass::Body(Body::Person) => "person",
            CoarseClass::Body(Body::TwoWheeler) => "two_wheeler",
            CoarseClass::Body(Body::LargeVehicle) => "large_vehicle",
            CoarseClass::Pole => "pole",
            CoarseClass::Structure => "structure",
            CoarseClass::Vegetation => "vegetation",
            CoarseClass::Unknown => "unknown",
        }
    }
}

impl Serialize for CoarseClass {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key())
    }
}

impl<'de> Deserialize<'de> for CoarseClass {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        let found = Self::ALL.into_iter().find(|class| class.key() == key);
        found.ok_or_else(|| D::Error::custom(format!("`{key}` is no coarse class")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_classes_are_of_objects_and_all_names_differ() {
        let objects = CoarseClass::ALL.into_iter().filter(|class| class.is_object());
        assert!(objects.eq([0, 1, 2, 3].map(|class| CoarseClass::ALL[class])));
        let mut names = CoarseClass::ALL.map(CoarseClass::name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        let large = serde_json::json!(CoarseClass::Body(Body::LargeVehicle));
        assert_eq!(large, "large_vehicle");
        for class in CoarseClass::ALL {
            let read: CoarseClass = serde_json::from_value(serde_json::json!(class)).unwrap();
            assert_eq!(read, class);
        }
        assert!(serde_json::from_str::<CoarseClass>("\"house\"").is_err());
    }
}
