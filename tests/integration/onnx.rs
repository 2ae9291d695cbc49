//! Small networks in ONNX, built in memory: a protobuf of a few fields.

use std::path::Path;

fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn integer(number: u64, value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    varint(number << 3, &mut out);
    varint(value, &mut out);
    out
}

fn bytes(number: u64, value: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    varint(number << 3 | 2, &mut out);
    varint(value.len() as u64, &mut out);
    out.extend_from_slice(value);
    out
}

fn text(number: u64, value: &str) -> Vec<u8> {
    bytes(number, value.as_bytes())
}

/// An input or output: name and sizes, 0 for one that is open.
fn value(name: &str, sizes: &[u64]) -> Vec<u8> {
    let open = |axis: usize| text(2, &format!("{name}{axis}"));
    let dimension = |(axis, &size): (usize, &u64)| {
        bytes(1, &if size == 0 { open(axis) } else { integer(1, size) })
    };
    let shape: Vec<u8> = sizes.iter().enumerate().flat_map(dimension).collect();
    let tensor = [integer(1, 1), bytes(2, &shape)].concat();
    [text(1, name), bytes(2, &bytes(1, &tensor))].concat()
}

fn tensor(name: &str, sizes: &[u64], values: &[f32]) -> Vec<u8> {
    let sizes: Vec<u8> = sizes.iter().flat_map(|&size| integer(1, size)).collect();
    let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    [sizes, integer(2, 1), text(8, name), bytes(9, &raw)].concat()
}

fn node(kind: &str, inputs: &[&str], output: &str) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|name| text(1, name)).collect();
    [inputs, text(2, output), text(4, kind)].concat()
}

/// One 1 x 1 convolution: the score of each class is a sum over the channels, and a constant.
pub struct Linear {
    /// Sizes of the input, 0 for one that is open; the second is the number of channels.
    pub input: [u64; 4],
    /// For each class the factor of each channel ...
    pub weights: Vec<Vec<f32>>,
    /// ... and the constant.
    pub bias: Vec<f32>,
    /// Whether all but the images are folded into one dimension.
    pub is_flat: bool,
}

impl Linear {
    pub fn write(&self, path: &Path) {
        let (classes, channels) = (self.weights.len() as u64, self.input[1]);
        let weights: Vec<f32> = self.weights.iter().flatten().copied().collect();
        let mut nodes = bytes(1, &node("Conv", &["input", "weights", "bias"], "scores"));
        let mut output = vec![self.input[0], classes, self.input[2], self.input[3]];
        let mut name = "scores";
        if self.is_flat {
            nodes.extend(bytes(1, &node("Flatten", &["scores"], "flat")));
            (output, name) = (vec![0, 0], "flat");
        }
        let graph = [
            nodes,
            text(2, "graph"),
            bytes(5, &tensor("weights", &[classes, channels, 1, 1], &weights)),
            bytes(5, &tensor("bias", &[classes], &self.bias)),
            bytes(11, &value("input", &self.input)),
            bytes(12, &value(name, &output)),
        ];
        let opset = [text(1, ""), integer(2, 17)].concat();
        let model = [integer(1, 8), bytes(8, &opset), bytes(7, &graph.concat())].concat();
        std::fs::write(path, model).expect("a file");
    }
}
