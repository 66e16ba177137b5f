//! stub
pub mod events; pub mod timing;
pub struct Monitor { pub timer: timing::Timer }
impl Monitor { pub fn event(&mut self, e: &events::Event) { println!("{e:?}"); } }
