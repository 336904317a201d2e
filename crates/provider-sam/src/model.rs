//! The encoder and the decoder, loaded.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use motes_formats::tensors::TensorData;
use rten::{DataType, Dimension, NodeId, RunOptions, ThreadPool, Value, ValueType};

use crate::{Convention, SamError, Weights};

/// Side of the square of all published models, pixels.
const SIDE: usize = 1024;
/// Pixels of the square per cell of the decoder's grid.
const PER_CELL: usize = 4;

/// A graph and the file that it came from.
pub(crate) struct Graph {
    model: rten::Model,
    pub(crate) path: PathBuf,
    options: RunOptions,
}

/// An encoder and a decoder that belong together.
pub struct Model {
    pub(crate) encoder: Graph,
    pub(crate) decoder: Graph,
    /// Which export it is.
    pub convention: Convention,
    /// Side of the square that the encoder sees, pixels.
    pub side: usize,
    /// Whether the encoder takes colors 0 to 255 of the filled part, `[rows, columns, 3]`, and does the rest itself.
    pub(crate) takes_colors: bool,
}

impl Model {
    /// Loads the weights; `threads` is the number of threads, which does not change the results.
    ///
    /// # Errors
    /// A file cannot be loaded, or its inputs are of no known export.
    pub fn load(weights: &Weights, threads: usize) -> Result<Self, SamError> {
        let pool = Arc::new(ThreadPool::with_num_threads(threads.max(1)));
        let decoder = Graph::load(&weights.decoder, &pool)?;
        let names = decoder.input_names();
        let of = |what, graph: &Graph| SamError::Inputs {
            what,
            inputs: graph.input_names().join(", "),
            path: graph.path.clone(),
        };
        let convention = Convention::of(&names).ok_or_else(|| of("a decoder of SAM", &decoder))?;
        let encoder = Graph::load(&weights.encoder, &pool)?;
        let shape = match encoder.model.input_ids() {
            [_] => encoder.model.input_shape(0).unwrap_or_default(),
            _ => return Err(of("an encoder of SAM", &encoder)),
        };
        let takes_colors = shape.len() == 3;
        let fixed = |dimension: Option<&Dimension>| match dimension {
            Some(Dimension::Fixed(n)) => Some(*n),
            _ => None,
        };
        let colors = fixed(shape.get(if takes_colors { 2 } else { 1 })).unwrap_or(3);
        if !(3..=4).contains(&shape.len()) || colors != 3 {
            return Err(of("an encoder of SAM", &encoder));
        }
        let mask = decoder.shape("mask_input").and_then(|shape| fixed(shape.last()));
        let own = if takes_colors { None } else { fixed(shape.last()) };
        let side = own.or(mask.map(|cells| cells * PER_CELL)).unwrap_or(SIDE);
        let made = encoder.output_names();
        for name in convention.embeddings() {
            if !made.iter().any(|output| output == name) {
                let (missing, path) = ((*name).to_owned(), decoder.path.clone());
                return Err(SamError::Mismatch { missing, path });
            }
        }
        Ok(Self { encoder, decoder, convention, side, takes_colors })
    }
}

impl Graph {
    fn load(path: &Path, pool: &Arc<ThreadPool>) -> Result<Self, SamError> {
        Weights::check_size(path)?;
        let load = |cause: String, help| SamError::Load { cause, path: path.into(), help };
        let incomplete = "the file is incomplete or no ONNX file: copy or export it again";
        let model = rten::Model::load_file(path).map_err(|error| {
            let is_operator = error.kind() == rten::LoadErrorKind::OperatorInvalid;
            let other =
                "this operator is not known here: export the model again, in 32 bits (fp32)";
            load(one_line(&error.to_string()), if is_operator { other } else { incomplete })
        })?;
        if model.input_ids().is_empty() || model.output_ids().is_empty() {
            return Err(load("it has no inputs or outputs".into(), incomplete));
        }
        let options = RunOptions::default().with_thread_pool(Some(pool.clone()));
        Ok(Self { model, path: path.into(), options })
    }

    fn names(&self, ids: &[NodeId]) -> Vec<String> {
        let name = |id: &NodeId| self.model.node_info(*id)?.name().map(str::to_owned);
        ids.iter().filter_map(name).collect()
    }

    pub(crate) fn input_names(&self) -> Vec<String> {
        self.names(self.model.input_ids())
    }

    pub(crate) fn output_names(&self) -> Vec<String> {
        self.names(self.model.output_ids())
    }

    pub(crate) fn shape(&self, input: &str) -> Option<Vec<Dimension>> {
        let index = self.input_names().iter().position(|name| name == input)?;
        self.model.input_shape(index)
    }

    /// Whether an input wants whole numbers.
    fn is_integer(&self, input: &str) -> bool {
        let node = self.model.find_node(input).and_then(|id| self.model.node_info(id));
        node.and_then(|info| info.dtype()) == Some(ValueType::Tensor(DataType::Int32))
    }

    /// Runs the graph; values are converted to whole numbers where the graph wants them.
    pub(crate) fn run(
        &self,
        inputs: &[(&str, TensorData)],
        outputs: &[&str],
    ) -> Result<Vec<TensorData>, SamError> {
        let failed = |cause: String| SamError::Run { cause, path: self.path.clone() };
        let id = |name: &str| self.model.node_id(name).map_err(|e| failed(e.to_string()));
        let mut given = Vec::new();
        for (name, tensor) in inputs {
            let values = tensor.as_f32().unwrap_or_default();
            let shape = tensor.shape();
            let value = match self.is_integer(name) {
                true => {
                    let whole: Vec<i32> = values.iter().map(|v| v.round() as i32).collect();
                    rten_tensor_i32(shape, whole)
                }
                false => rten_tensor_f32(shape, values.to_vec()),
            };
            given.push((id(name)?, value.into()));
        }
        let wanted: Vec<NodeId> = outputs.iter().map(|name| id(name)).collect::<Result<_, _>>()?;
        let found = self.model.run(given, &wanted, Some(self.options.clone()));
        let found = found.map_err(|error| failed(one_line(&error.to_string())))?;
        let mut tensors = Vec::new();
        for (value, name) in found.into_iter().zip(outputs) {
            let tensor = value.into_tensor::<f32>().ok_or_else(|| {
                failed(format!("the output {name} holds no floating-point numbers"))
            })?;
            let (shape, values) = shaped(tensor);
            if let Some(odd) = values.iter().find(|v| !v.is_finite()) {
                return Err(failed(format!(
                    "the output {name} has values that are not finite ({odd})"
                )));
            }
            tensors.push(TensorData::F32(shape, values));
        }
        Ok(tensors)
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect()
}

fn rten_tensor_f32(shape: &[usize], values: Vec<f32>) -> Value {
    rten_tensor::Tensor::from_data(shape, values).into()
}

fn rten_tensor_i32(shape: &[usize], values: Vec<i32>) -> Value {
    rten_tensor::Tensor::from_data(shape, values).into()
}

fn shaped(tensor: rten_tensor::Tensor<f32>) -> (Vec<usize>, Vec<f32>) {
    use rten_tensor::prelude::*;
    (tensor.shape().to_vec(), tensor.to_vec())
}
