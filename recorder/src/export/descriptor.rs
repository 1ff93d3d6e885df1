//! How the messages of an export are described to the programs that read them: as their `.proto` files do.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

/// A field: name, number, type, and whether it repeats. A type that is no plain one is a message of the package.
type Field = (&'static str, i32, &'static str, bool);

const STAMP: &str = ".google.protobuf.Timestamp";

/// The messages of [`super::messages`] as their `.proto` files describe them, in an order in which each stands after what it is made of.
const MESSAGES: [(&str, &[Field]); 16] = [
    ("Vector3", &[("x", 1, "double", false), ("y", 2, "double", false), ("z", 3, "double", false)]),
    (
        "Quaternion",
        &[
            ("x", 1, "double", false),
            ("y", 2, "double", false),
            ("z", 3, "double", false),
            ("w", 4, "double", false),
        ],
    ),
    ("Pose", &[("position", 1, "Vector3", false), ("orientation", 2, "Quaternion", false)]),
    (
        "PosesInFrame",
        &[("timestamp", 1, STAMP, false), ("frame_id", 2, "string", false), ("poses", 3, "Pose", true)],
    ),
    (
        "FrameTransform",
        &[
            ("timestamp", 1, STAMP, false),
            ("parent_frame_id", 2, "string", false),
            ("child_frame_id", 3, "string", false),
            ("translation", 4, "Vector3", false),
            ("rotation", 5, "Quaternion", false),
        ],
    ),
    ("FrameTransforms", &[("transforms", 1, "FrameTransform", true)]),
    (
        "Color",
        &[
            ("r", 1, "double", false),
            ("g", 2, "double", false),
            ("b", 3, "double", false),
            ("a", 4, "double", false),
        ],
    ),
    ("Point3", &[("x", 1, "double", false), ("y", 2, "double", false), ("z", 3, "double", false)]),
    (
        "LinePrimitive",
        &[
            ("type", 1, "enum", false),
            ("pose", 2, "Pose", false),
            ("thickness", 3, "double", false),
            ("points", 5, "Point3", true),
            ("color", 6, "Color", false),
        ],
    ),
    (
        "SpherePrimitive",
        &[("pose", 1, "Pose", false), ("size", 2, "Vector3", false), ("color", 3, "Color", false)],
    ),
    (
        "CubePrimitive",
        &[("pose", 1, "Pose", false), ("size", 2, "Vector3", false), ("color", 3, "Color", false)],
    ),
    (
        "CylinderPrimitive",
        &[
            ("pose", 1, "Pose", false),
            ("size", 2, "Vector3", false),
            ("bottom_scale", 3, "double", false),
            ("top_scale", 4, "double", false),
            ("color", 5, "Color", false),
        ],
    ),
    (
        "SceneEntity",
        &[
            ("timestamp", 1, STAMP, false),
            ("frame_id", 2, "string", false),
            ("id", 3, "string", false),
            ("lifetime", 4, ".google.protobuf.Duration", false),
            ("frame_locked", 5, "bool", false),
            ("cubes", 8, "CubePrimitive", true),
            ("spheres", 9, "SpherePrimitive", true),
            ("cylinders", 10, "CylinderPrimitive", true),
            ("lines", 11, "LinePrimitive", true),
        ],
    ),
    ("SceneUpdate", &[("entities", 2, "SceneEntity", true)]),
    (
        "CameraCalibration",
        &[
            ("timestamp", 1, STAMP, false),
            ("frame_id", 9, "string", false),
            ("width", 2, "fixed32", false),
            ("height", 3, "fixed32", false),
            ("K", 6, "double", true),
            ("R", 7, "double", true),
            ("P", 8, "double", true),
        ],
    ),
    (
        "Log",
        &[
            ("timestamp", 1, STAMP, false),
            ("level", 2, "enum", false),
            ("message", 3, "string", false),
            ("name", 4, "string", false),
        ],
    ),
];

/// The values of an enum, by the message that it belongs to.
fn enum_of(message: &str) -> (&'static str, &'static [&'static str]) {
    match message {
        "LinePrimitive" => ("Type", &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"]),
        _ => ("Level", &["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"]),
    }
}

/// The `FileDescriptorSet` of a message of [`super::messages`] and of everything that it is made of, as a viewer wants it
/// beside a channel.
///
/// # Panics
///
/// If there is no message of this name: a programmer's error.
pub fn descriptor(message: &str) -> Vec<u8> {
    let mut wanted = vec![message.to_owned()];
    let mut files = Vec::new();
    // From the last to the first: what a message is made of stands before it.
    for (name, fields) in MESSAGES.iter().rev() {
        if !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        wanted.extend(fields.iter().map(|field| field.2.to_owned()));
        files.push(file_of(name, fields));
    }
    assert!(!files.is_empty(), "no message {message} is exported");
    for name in ["Timestamp", "Duration"] {
        if wanted.iter().any(|wanted| *wanted == format!(".google.protobuf.{name}")) {
            let fields = [("seconds", 1, "int64", false), ("nanos", 2, "int32", false)];
            let message = message_of(name, &fields, "google.protobuf");
            files.push(file(
                &format!("google/protobuf/{}.proto", name.to_lowercase()),
                "google.protobuf",
                message,
            ));
        }
    }
    files.reverse();
    FileDescriptorSet { file: files }.encode_to_vec()
}

fn file_of(name: &str, fields: &[Field]) -> FileDescriptorProto {
    let mut dependency: Vec<_> = fields.iter().filter_map(|&(_, _, kind, _)| home_of(kind)).collect();
    dependency.sort();
    dependency.dedup();
    let message = message_of(name, fields, "foxglove");
    FileDescriptorProto { dependency, ..file(&format!("foxglove/{name}.proto"), "foxglove", message) }
}

fn file(name: &str, package: &str, message: DescriptorProto) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        message_type: vec![message],
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    }
}

/// The file that describes a type, unless it is a plain one.
fn home_of(kind: &str) -> Option<String> {
    match kind.strip_prefix(".google.protobuf.") {
        Some(name) => Some(format!("google/protobuf/{}.proto", name.to_lowercase())),
        None => kind.starts_with(char::is_uppercase).then(|| format!("foxglove/{kind}.proto")),
    }
}

fn message_of(name: &str, fields: &[Field], package: &str) -> DescriptorProto {
    let field = |&(field, number, kind, repeated): &Field| {
        let (plain, type_name) = match kind {
            "double" => (Type::Double, None),
            "string" => (Type::String, None),
            "bool" => (Type::Bool, None),
            "fixed32" => (Type::Fixed32, None),
            "int32" => (Type::Int32, None),
            "int64" => (Type::Int64, None),
            "enum" => (Type::Enum, Some(format!(".{package}.{name}.{}", enum_of(name).0))),
            other if other.starts_with('.') => (Type::Message, Some(other.to_owned())),
            other => (Type::Message, Some(format!(".{package}.{other}"))),
        };
        FieldDescriptorProto {
            name: Some(field.to_owned()),
            number: Some(number),
            label: Some(if repeated { Label::Repeated } else { Label::Optional } as i32),
            r#type: Some(plain as i32),
            type_name,
            ..Default::default()
        }
    };
    let has_enum = fields.iter().any(|field| field.2 == "enum");
    let (enum_name, values) = enum_of(name);
    let value = |(number, value): (i32, &&str)| EnumValueDescriptorProto {
        name: Some((*value).to_owned()),
        number: Some(number),
        ..Default::default()
    };
    let enum_type = EnumDescriptorProto {
        name: Some(enum_name.to_owned()),
        value: (0..).zip(values).map(value).collect(),
        ..Default::default()
    };
    DescriptorProto {
        name: Some(name.to_owned()),
        field: fields.iter().map(field).collect(),
        enum_type: if has_enum { vec![enum_type] } else { Vec::new() },
        ..Default::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_descriptor_has_what_its_message_is_made_of_in_order() {
        let files = |message: &str| -> Vec<FileDescriptorProto> {
            FileDescriptorSet::decode(&descriptor(message)[..]).expect("a descriptor").file
        };
        let names: Vec<_> = files("PosesInFrame").iter().map(|file| file.name().to_owned()).collect();
        let expected =
            ["google/protobuf/timestamp", "foxglove/Vector3", "foxglove/Quaternion", "foxglove/Pose"];
        let expected =
            expected.into_iter().chain(["foxglove/PosesInFrame"]).map(|name| format!("{name}.proto"));
        assert_eq!(names, expected.collect::<Vec<_>>());
        for (message, _) in MESSAGES {
            let files = files(message);
            assert_eq!(files.last().expect("files").message_type[0].name(), message);
            for (number, file) in files.iter().enumerate() {
                for needed in &file.dependency {
                    let before = files[..number].iter().any(|earlier| earlier.name() == needed);
                    assert!(before, "{} needs {needed}", file.name());
                }
            }
        }
    }
}
