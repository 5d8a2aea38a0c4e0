:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(horizon)).
:- use_module(planner_golog(search)).
:- use_module(planner_golog(travel)).

% Look finds out whether something is there; nobody knows before.

camp :-
    load_facts([ kind(z, r1, 'Robot'), kind(z, r2, 'Robot'), kind(z, b1, 'Box'), kind(z, b2, 'Box'),
                 agent(z, 'Look'(R1, _), R1), duration(z, 'Look'(_, _), fixed(10)),
                 agent(z, 'Take'(R2), R2), duration(z, 'Take'(_), fixed(100)),
                 definition(z, 'Fetch'(R3), F3, [call(F3, look, 'Look'(R3, loc(F3, there))),
                                                 if(is_true(loc(F3, there)), call(F3, take, 'Take'(R3)), [])]),
                 definition(z, 'Waits', F4, test(is_true(loc(F4, there)))),
                 duration(z, 'Drive'(D), travel(D, p1, 0)), agent(z, 'Drive'(R5), R5),
                 definition(z, 'Drive'(_), F6, until(call(F6, on, 'Take'(r1)), is_true(loc(F6, arrived)))),
                 definition(z, 'Never', _, test(holds(full, tank, true)))
               ], _).

camp_gone :- drop_facts(z, _).

looking(S) :- no_travel(Travel), situation(z, plan(Travel), 2, 0, S).
acting(S) :- no_guide(Guide), situation(z, act(Guide), 2, 0, S).
best(P, Result) :- looking(S), best_plan(P, S, 1000, Result).
asks(test(is_true(loc(f, x)))).
take(Id, R, call(f, Id, 'Take'(R))).

:- begin_tests(halted, [setup(camp), cleanup(camp_gone)]).

test('a program halts where it goes on by what only acting finds out',
     forall(member(P, [T, [T, K], if(C, K, []), while(C, K), until([], C), conc([T, []]), pconc([T]), search(T),
                       deadline(9, T), picked(p-r1, p, T), scope(s, 'Never', T), [[], T],
                       foreach(f, e, [_-'Box'], C, _, K)]))) :-
    asks(T), T = test(C), take(k, r1, K), looking(S), halted(P, S, [loc(f, x)]).
test('a call halts where its body does', Ls == [loc('f/w', there)]) :- looking(S), halted(call(f, w, 'Waits'), S, Ls).
test('side by side, all parts must halt or have ended', fail) :- asks(T), take(k, r1, K), looking(S), halted(conc([T, K]), S, _).
test('then it waits for all that they ask for', Ls == [loc(f, x), loc(g, y)]) :-
    asks(T), looking(S), halted(conc([test(is_true(loc(g, y))), T, T]), S, Ls).
test('what has ended does not halt', fail) :- looking(S), halted([], S, _).
test('what can go on does not either', fail) :- take(k, r1, K), asks(T), looking(S), halted([K, T], S, _).
test('nor what waits for something else', fail) :- looking(S), halted(test(holds(full, tank, true)), S, _).
test('nor a loop on what is known', fail) :- take(k, r1, K), looking(S), halted(while(holds(full, tank, true), K), S, _).
test('acting, nothing halts: what is not found out is false', fail) :- asks(T), acting(S), halted(T, S, _).
test('whether it may halt is told beforehand, and of what it calls') :-
    take(k, r1, K), asks(T), looking(S),
    may_halt([K, choice(f, c, [T])], S), may_halt(call(f, a, 'Fetch'(r1)), S), \+ may_halt([K, call(f, n, 'Never')], S).
test('what is one step when looking ahead may not', fail) :- looking(S), may_halt(call(f, d, 'Drive'(r1)), S).
test('acting, it may') :- acting(S), may_halt(call(f, d, 'Drive'(r1)), S).

:- end_tests(halted).

:- begin_tests(plans, [setup(camp), cleanup(camp_gone)]).

test('a plan goes that far', M-Waits == 10-[loc('f/a', there)]) :-
    best(call(f, a, 'Fetch'(r1)), plan(optimal, M, M, _, Waits, _)).
test('of parts side by side it has all that can be done', M-Waits == 110-[loc('f/b', there)]) :-
    take(a, r1, K), best(conc([[K, call(f, l, 'Look'(r1, loc(f, x)))], call(f, b, 'Fetch'(r2))]), plan(optimal, M, M, _, Waits, _)).
test('a pick before it is made', Waits-X == [loc(f, x)]-r1) :-
    asks(test(C)), best([call(f, l, 'Look'(r1, loc(f, x))), pick(f, p, R, 'Robot', if(C, call(f, k, 'Take'(R)), []))],
                        plan(optimal, 10, 10, Events, Waits, _)),
    memberchk(chose('f/p', X), Events).
test('a branch that halts is one that can be taken', N == 1) :-
    asks(T), take(k, r1, K), best(choice(f, c, [[T, K], K]), plan(optimal, 0, 0, Events, [loc(f, x)], _)),
    memberchk(chose('f/c', N), Events).
test('a part of any order that halts is begun', Waits == [loc(f, x)]) :-
    asks(T), take(k, r1, K), best(any_order(f, o, [[T, K], [T, K]]), plan(optimal, 0, 0, _, Waits, _)).
test('what comes to a horizon on no way is impossible') :-
    asks(T), best([call(f, n, 'Never'), T], none(proven, _)).

:- end_tests(plans).
