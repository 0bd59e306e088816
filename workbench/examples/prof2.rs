use truing::*;
fn main(){ let a:Vec<String>=std::env::args().collect(); let m=model::read(a[1].as_ref()).unwrap(); let log::Log::Dynamic(l)=log::read(a[2].as_ref(),&Default::default()).unwrap() else {panic!()};
 let b=bench::prepare(&m,&l,&[]).unwrap(); let h=hypothesis::Hypothesis::new(&b,&m,vec![]); let p=h.plant(&vec![0.0;h.slots.len()]); let mut tr=bench::Traces::default(); let n:usize=a[3].parse().unwrap(); for _ in 0..n { b.runs[0].simulate(&p,0.0,fit::COARSE,&mut tr);} }
