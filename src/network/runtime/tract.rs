//! tract: networks in Rust alone.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::Factoid;

use super::interface::{Runtime, Tensor as Values, four};

/// A network for tract. It is compiled for each shape of its input once.
pub(super) struct Tract {
    model: InferenceModel,
    input: Vec<Option<usize>>,
    compiled: Mutex<BTreeMap<[usize; 4], Arc<TypedRunnableModel>>>,
}

impl std::fmt::Debug for Tract {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Tract").field("input", &self.input).finish_non_exhaustive()
    }
}

impl Tract {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let read = || {
            let model = tract_onnx::onnx().with_ignore_output_shapes(true).model_for_path(path)?;
            let shape = &model.input_fact(0)?.shape;
            let input = (0..shape.rank().concretize().unwrap_or(0) as usize)
                .map(|axis| shape.dim(axis).and_then(|dim| dim.concretize()?.to_i64().ok()))
                .map(|side: Option<i64>| side.and_then(|side| usize::try_from(side).ok()))
                .collect();
            Ok(Tract { model, input, compiled: Mutex::default() })
        };
        read().map_err(|error: TractError| format!("tract cannot read it as ONNX: {error:#}"))
    }

    fn compiled(&self, shape: [usize; 4]) -> TractResult<Arc<TypedRunnableModel>> {
        let mut all = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = all.get(&shape) {
            return Ok(Arc::clone(known));
        }
        let model = self.model.clone().with_input_fact(0, f32::fact(shape).into())?;
        let made = model.into_optimized()?.into_runnable()?;
        all.insert(shape, Arc::clone(&made));
        Ok(made)
    }
}

impl Runtime for Tract {
    fn input(&self) -> Vec<Option<usize>> {
        self.input.clone()
    }

    fn run(&self, input: Values) -> Result<Values, String> {
        let run = || {
            let compiled = self.compiled(input.shape)?;
            let tensor = Tensor::from_shape(&input.shape, &input.values)?;
            let output = compiled.run(tvec!(tensor.into()))?;
            let first = output
                .first()
                .ok_or_else(|| TractError::msg("it gives nothing"))?
                .cast_to::<f32>()?
                .into_owned();
            let shape = first.shape().to_vec();
            let values = first.try_as_plain_ram()?.as_slice::<f32>()?.to_vec();
            Ok((shape, values))
        };
        let (shape, values) =
            run().map_err(|error: TractError| format!("tract cannot run it: {error:#}"))?;
        Ok(Values { shape: four(&shape)?, values })
    }

    fn describe(&self) -> String {
        "tract on the processor".to_owned()
    }
}
