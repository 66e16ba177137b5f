//! stub
pub struct Timer { start: std::time::Instant, pub acc: std::cell::RefCell<std::collections::BTreeMap<&'static str,(usize,f64)>> }
impl Timer { pub fn new()->Self{Self{start:std::time::Instant::now(),acc:Default::default()}} pub fn seconds(&self)->f64{self.start.elapsed().as_secs_f64()} pub fn time<T>(&self,name:&'static str,f:impl FnOnce()->T)->T{let t=self.seconds();let r=f();let d=self.seconds()-t;let mut a=self.acc.borrow_mut();let e=a.entry(name).or_default();e.0+=1;e.1+=d;r} }
